"""The keypoint source in a process of its own: what the node asks there, and what answers."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache

from pop_core.body.default_body import default_body
from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.background import Background
from pop_core.tracking.looks import look_for_people
from pop_ros.keypoint_sources import apply_settings
from pop_ros.node_arguments import SourceArguments
from pop_ros.warm_up import OnePerson, small_scene

LOOKING_NICENESS = 5  # whoever comes out from behind something is waited for


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
    _warm_up(detector)
    return detector


@lru_cache(maxsize=1)
def _eyes(sources: SourceArguments, config: PipelineConfig) -> Eyes:
    detector = _detector(sources)
    apply_settings(detector, config)
    return Eyes(detector, config)


def _warm_up(detector: KeypointDetector) -> None:
    """Look once with the source and once for somebody, so that no real frame pays for loading."""
    frame, somebody = small_scene(default_body())
    with suppress(PopError):  # files hold no keypoints of this frame
        detector.detect(frame)
    look_for_people(Eyes(OnePerson(somebody), PipelineConfig()), frame, frame)
