"""The one place where a pipeline is put together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from pop_ros.keypoint_sources import SOURCES, SourceError, apply_settings, make_detector
from pop_ros.model_files import ModelFiles

if TYPE_CHECKING:
    from pop_core.config import PipelineConfig
    from pop_core.keypoints.detection import KeypointDetector
    from pop_core.pipeline import BodyPipeline

__all__ = ['SOURCES', 'SourceError', 'make_detector', 'make_pipeline']

Progress = Callable[[float, str], None]


def make_pipeline(
    detector: KeypointDetector,
    config: PipelineConfig | None = None,
    body_file: str | Path | None = None,
    library_file: str | Path | None = None,
    progress: Progress | None = None,
) -> BodyPipeline:
    """Return a pipeline with its body model and pose library loaded and its kernels compiled.

    Args:
        detector: Keypoint source.
        config: Settings, of the source too; None takes the defaults.
        body_file: Body model (.npz) in place of the default body.
        library_file: Pose library in place of the default one.
        progress: Called with a share 0..1 and a sentence while a first library is generated, and
            before kernels are compiled for the first time.

    Raises:
        SourceError: If the detector is none.
        PopError: If a file is missing, damaged or not of its format.
    """
    from pop_core.keypoints.detection import KeypointDetector
    from pop_core.pipeline import BodyPipeline
    from pop_ros.kernel_cache import look_at_kernels
    from pop_ros.warm_up import warm_up

    if isinstance(detector, type) or not isinstance(detector, KeypointDetector):
        raise SourceError(
            "pipeline: expected a detector with detect(frame), as make_detector('depth') makes, "
            f'found {detector!r}')
    models = ModelFiles(
        *(None if file is None else Path(file) for file in (body_file, library_file)))
    model = models.load_body()
    library = models.load_library(model, None if progress is None else _as_counter(progress))
    if progress is not None and (missing := look_at_kernels().missing):
        progress(0.0, f'compiling kernels of {len(missing)} modules: about a minute, once')
    if config is not None:
        apply_settings(detector, config)
    pipeline = BodyPipeline(model, library, detector, config)
    warm_up(pipeline)
    return pipeline


def _as_counter(progress: Progress) -> Callable[[int, int], None]:
    def told(done: int, wanted: int) -> None:
        share = done / max(wanted, 1)
        progress(share, f'generating the pose library: {done} of {wanted} poses')

    return told
