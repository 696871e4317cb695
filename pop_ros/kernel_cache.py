"""Whether the compiled kernels are in the cache, or the first start has to compile them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

SUFFIX = '_kernels'


@dataclass(frozen=True, slots=True)
class KernelCache:
    """What is known of the compiled kernels of the modules that fit people.

    Args:
        folders: Where numba keeps them.
        cached: Modules with compiled kernels.
        missing: Modules without.
    """

    folders: tuple[Path, ...]
    cached: tuple[str, ...]
    missing: tuple[str, ...]

    @property
    def is_writable(self) -> bool:
        """Return whether what is compiled can be kept."""
        return all(os.access(folder, os.W_OK) for folder in self.folders if folder.is_dir())


def look_at_kernels() -> KernelCache:
    """Return the state of the cache; imports the pipeline."""
    import pop_core.pipeline  # noqa: F401 - whose kernels these are

    found = dict(_kernel_folders())
    cached = tuple(name for name, folder in found.items() if _is_cached(name, folder))
    missing = tuple(name for name in found if name not in cached)
    return KernelCache(tuple(dict.fromkeys(found.values())), cached, missing)


def _kernel_folders() -> Iterator[tuple[str, Path]]:
    """Yield each imported module of kernels and the folder where numba keeps its compilations."""
    for name in sorted(sys.modules):
        if not (name.startswith('pop_core.') and name.endswith(SUFFIX)):
            continue
        # Kernels of other modules are imported here and there.
        kernels = (getattr(value, 'stats', None) for value in vars(sys.modules[name]).values()
                   if getattr(value, '__module__', '') == name)
        folder = next((stats.cache_path for stats in kernels if stats is not None), None)
        if folder is not None:
            yield name, Path(folder)


def _is_cached(name: str, folder: Path) -> bool:
    return any(folder.glob(f'{name.rpartition(".")[2]}.*.nbi'))
