"""From the messages of the next frame to the messages of its bodies."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import Any

from pop_core.body.model import BodyModel
from pop_core.config import PipelineConfig
from pop_core.errors import RepeatedStampError
from pop_core.estimate import FrameResult
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.pipeline import BodyPipeline
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.background import Background
from pop_core.tracking.tracker import BodyTracker
from pop_ros.body_messages import RECORDED_TYPES, BodyMessages, Output
from pop_ros.frame_maker import FrameMaker
from pop_ros.keypoint_sources import apply_settings
from pop_ros.model_files import PACKAGED, ModelFiles
from pop_ros.node_config import NodeConfig
from pop_ros.sources import make_pipeline
from pop_ros.static_frames import StaticFrames, parse_extrinsics

PAUSE_S = 1.0  # of cameras that go on none is as long


@dataclass(frozen=True, slots=True, eq=False)
class FittedFrame:
    """What became of one frame.

    Args:
        frame: The frame itself.
        result: The pipeline's result.
        outputs: Messages by topic, made while they are read, once.
    """

    frame: RgbdFrame
    result: FrameResult
    outputs: Iterator[Output]


class FrameFitter:
    """A pipeline that follows people, with ROS messages on both sides."""

    def __init__(
        self,
        detector: KeypointDetector,
        pipeline_config: PipelineConfig,
        config: NodeConfig,
        progress: Callable[[float, str], None] | None = None,
        frames: StaticFrames | None = None,
        *,
        models: ModelFiles = PACKAGED,
        finding: Background | None = None,
        looking: Background | None = None,
        searching: Background | None = None,
    ) -> None:
        """Load body model and pose library, and compile kernels.

        Args:
            detector: Keypoint source.
            pipeline_config: Settings of the pipeline.
            config: Settings of messages and of the tracker.
            progress: Told a share 0..1 and a sentence while a first library is generated.
            frames: Knows where a depth camera with a frame of its own stands.
            models: Files of body model and pose library.
            finding: Finds people anew while others are followed; None lets frames wait.
            looking: Asks the keypoint source while people are followed; None lets frames wait.
            searching: Looks for lost limbs while people are followed; None lets frames wait.

        Raises:
            PopError: If one of them cannot be loaded.
        """
        apply_settings(detector, pipeline_config)
        self._pipeline = make_pipeline(
            detector, pipeline_config, models.body, models.library, progress)
        self._tracker = BodyTracker(
            self._pipeline, config.tracking, finding, looking, searching)
        self._followed_s = -math.inf
        self._messages = BodyMessages(self._pipeline.model, config)
        self._maker = FrameMaker(frames or StaticFrames())
        self._configure_inputs(config)

    @property
    def model(self) -> BodyModel:
        """Return the body model that is fitted."""
        return self._pipeline.model

    def configure(self, pipeline_config: PipelineConfig, config: NodeConfig) -> None:
        """Take over changed settings; model, library and keypoint source stay loaded."""
        old = self._pipeline
        apply_settings(old.detector, pipeline_config)
        self._pipeline = BodyPipeline(
            old.model, old.library, old.detector, pipeline_config, old.fitter.prior,
            old.completion)
        self._tracker.configure(self._pipeline, config.tracking)
        self._messages.configure(config)
        self._configure_inputs(config)

    def _configure_inputs(self, config: NodeConfig) -> None:
        self._maker.extrinsics = parse_extrinsics(config.depth.extrinsics)
        self._maker.is_rectified = config.input.rectified
        self._maker.quarter_turns = config.input.quarter_turns

    def reset(self) -> None:
        """Start the ids of people anew."""
        self._tracker.reset()
        self._messages.reset()

    def clear(self, wanted: Collection[str]) -> list[Output]:
        """Return the messages that remove everybody who is shown."""
        return self._messages.clear(wanted)

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the keypoints of a frame.

        Raises:
            PopError: If the keypoint source cannot read what it needs for this frame.
        """
        return self._pipeline.detector.detect(frame)

    def fit(
        self, color: Any, depth: Any, info: Any, depth_info: Any = None,
        *, wanted: Collection[str] = tuple(RECORDED_TYPES), skipped: int = 0,
    ) -> FittedFrame:
        """Return result and messages of a pair of images and their CameraInfo.

        Args:
            color: Image or CompressedImage of colour.
            depth: Image or CompressedImage of depth.
            info: CameraInfo of the colour camera.
            depth_info: CameraInfo of the depth camera, or None.
            wanted: Names of the outputs that messages are made for.
            skipped: Pairs since the last one that nobody had time for.

        Raises:
            BadMessageError: If the messages make no frame.
            PopError: If the keypoint source cannot read what it needs for this frame, or could not
                for an earlier one that was looked at meanwhile.
        """
        frame = self._maker.make(color, depth, info, depth_info)
        if self._tracker.config.enabled:
            result = self._follow(frame, skipped)
        else:
            result = self._pipeline.process(frame)
        outputs = self._messages.stream(result, frame, color.header.frame_id, wanted)
        return FittedFrame(frame, result, outputs)

    def _follow(self, frame: RgbdFrame, skipped: int) -> FrameResult:
        """Return the people of the next frame; after a pause an old one begins a recording anew.

        Whoever ends a replay after its first frame, and starts it again, shows that frame again.
        """
        paused = time.monotonic() - self._followed_s > PAUSE_S
        try:
            return self._tracker.process(frame, skipped)
        except RepeatedStampError:
            if not paused:
                raise
            self._tracker.begin_anew()
            return self._tracker.process(frame, skipped)
        finally:
            self._followed_s = time.monotonic()
