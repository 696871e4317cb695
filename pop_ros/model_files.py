"""Which body is fitted and which poses it starts from: files that a user named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pop_core.body.model import BodyModel
    from pop_core.retrieval.pose_library import PoseLibrary


@dataclass(frozen=True, slots=True)
class ModelFiles:
    """Files in place of the body and the poses that come with the package.

    Paths are made absolute, so that they mean the same in every process.

    Args:
        body: Body model made by `pop body import`, or None for the default one.
        library: Pose library made by `pop library build`, or None for the default one.
    """

    body: Path | None = None
    library: Path | None = None

    def __post_init__(self) -> None:
        for name in ('body', 'library'):
            path: Path | None = getattr(self, name)
            if path is not None:
                object.__setattr__(self, name, Path(path).expanduser().absolute())

    def as_flags(self) -> list[str]:
        """Return the flags that name these files."""
        named = {'--body': self.body, '--library': self.library}
        return [
            word for flag, path in named.items() if path is not None for word in (flag, str(path))]

    def check(self) -> None:
        """Read the body, and what the library says about itself.

        Raises:
            PopError: If a file is missing, damaged or not of its format.
        """
        from pop_core.retrieval.library_file import read_header

        self.load_body()
        if self.library is not None:
            read_header(self.library)

    def load_body(self) -> BodyModel:
        """Return the body model.

        Raises:
            ModelFileError: If the file is missing, damaged or no body model.
        """
        from pop_core.body.default_body import default_body
        from pop_core.body.model_file import load_body_model

        return default_body() if self.body is None else load_body_model(self.body)

    def load_library(
        self, model: BodyModel, progress: Callable[[int, int], None] | None = None
    ) -> PoseLibrary:
        """Return the pose library.

        Args:
            model: The body that takes these poses.
            progress: Called with poses done and wanted while the default library is generated.

        Raises:
            LibraryFileError: If the file is missing, damaged or no pose library.
        """
        from pop_core.retrieval.default_library import default_library
        from pop_core.retrieval.library_file import load_library
        from pop_core.retrieval.pose_library import on_body

        library = default_library(progress) if self.library is None else load_library(self.library)
        return library if self.body is None else on_body(library, model)


PACKAGED = ModelFiles()
