"""The keypoint source in a process of its own: what the node asks there, and what answers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from pop_core.body.joints import N_SHARED
from pop_core.config import PipelineConfig
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.background import Background
from pop_core.tracking.looks import look_for_people
from pop_ros.keypoint_sources import apply_settings
from pop_ros.node_arguments import SourceArguments

LOOKING_NICENESS = 5  # whoever comes out from behind something is waited for
WARM_CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
WARM_WALL_M = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Eyes:
    """What looks for people.

    Args:
        detector: The keypoint source.
        config: Settings.
    """

    detector: KeypointDetector
    config: PipelineConfig


@dataclass(frozen=True, slots=True)
class Looking:
    """Opens the keypoint source that a user named, in the process that calls it.

    Args:
        sources: Where keypoints come from.
    """

    sources: SourceArguments

    def __call__(self, config: PipelineConfig) -> Eyes:
        """Return the source with these settings; it is loaded once."""
        return _eyes(self.sources, config)


class DistantDetector:
    """A keypoint source in another process, for whoever waits for its answer."""

    def __init__(self, looking: Background) -> None:
        """Ask whoever has the source."""
        self._looking = looking

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people in a frame.

        Raises:
            PopError: If the source cannot read what it needs for this frame, or its process ended.
        """
        return self._looking.submit(_detect, frame).result()


def _detect(eyes: Eyes, frame: RgbdFrame) -> list[Detection]:
    return eyes.detector.detect(frame)


@lru_cache(maxsize=1)
def _detector(sources: SourceArguments) -> KeypointDetector:
    detector = sources.detector()
    _warm_up()
    return detector


@lru_cache(maxsize=1)
def _eyes(sources: SourceArguments, config: PipelineConfig) -> Eyes:
    detector = _detector(sources)
    apply_settings(detector, config)
    return Eyes(detector, config)


class _Somebody:
    """Keypoints all over the image."""

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return one person."""
        size = np.array([frame.camera.width, frame.camera.height], dtype=np.float64)
        across = np.linspace(0.2, 0.8, N_SHARED)[:, None] * size
        return [Detection(across, np.ones(N_SHARED), np.concatenate([0.2 * size, 0.8 * size]))]


def _warm_up() -> None:
    """Look once, so that no real frame pays for loading kernels."""
    shape = WARM_CAMERA.height, WARM_CAMERA.width
    frame = RgbdFrame(
        np.zeros((*shape, 3), dtype=np.uint8), np.full(shape, WARM_WALL_M, dtype=np.float32),
        WARM_CAMERA)
    look_for_people(Eyes(_Somebody(), PipelineConfig()), frame, frame)
