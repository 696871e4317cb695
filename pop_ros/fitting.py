"""What people are fitted with in a process beside the node: the node's body and its poses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from pop_core.config import PipelineConfig
from pop_core.keypoints.detection import Detection
from pop_core.pipeline import BodyPipeline
from pop_core.rgbd import RgbdFrame
from pop_ros.model_files import PACKAGED, ModelFiles
from pop_ros.sources import make_pipeline


class Nobody:
    """A keypoint source for a pipeline that is given its detections."""

    def detect(self, _frame: RgbdFrame) -> list[Detection]:
        """Return no people."""
        return []


@dataclass(frozen=True, slots=True)
class Fitting:
    """Loads body and library, in the process that calls it.

    Args:
        models: The files that the node loaded them from.
    """

    models: ModelFiles = PACKAGED

    def __call__(self, config: PipelineConfig) -> BodyPipeline:
        """Return a pipeline that fits people who are already detected; it is loaded once.

        Raises:
            PopError: If a file cannot be read.
        """
        return _pipeline(self.models, config)


@lru_cache(maxsize=1)
def _loaded(models: ModelFiles) -> BodyPipeline:
    return make_pipeline(Nobody(), None, models.body, models.library)


@lru_cache(maxsize=1)
def _pipeline(models: ModelFiles, config: PipelineConfig) -> BodyPipeline:
    loaded = _loaded(models)
    return BodyPipeline(
        loaded.model, loaded.library, Nobody(), config, loaded.fitter.prior, loaded.completion)
