"""A recording that is played twice: ids, track states and removals as subscribers get them."""

from typing import Any

import pytest
from rclpy.serialization import deserialize_message
from support.messages import camera_info, depth_image, image
from support.recording import Recording, record
from visualization_msgs.msg import Marker

from pop_core.config import PipelineConfig
from pop_core.errors import RepeatedStampError
from pop_core.estimate import TrackState
from pop_core.keypoints.openpose_json import OpenPoseJsonDetector
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.tracking_config import TrackingConfig
from pop_ros import frame_fitter
from pop_ros.body_messages import MESH
from pop_ros.frame_fitter import FittedFrame, FrameFitter
from pop_ros.node_config import NodeConfig


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=4, rate_hz=15.0)


def fitter_of(recording: Recording, config: NodeConfig | None = None) -> FrameFitter:
    detector = OpenPoseJsonDetector(recording.keypoints)
    return FrameFitter(detector, PipelineConfig(), config or NodeConfig())


def fit(fitter: FrameFitter, frame: RgbdFrame) -> FittedFrame:
    stamp = frame.stamp_ns
    return fitter.fit(
        image(frame.rgb, 'rgb8', stamp), depth_image(frame.depth_m, '16UC1', stamp),
        camera_info(frame.camera, stamp), wanted=(MESH,))


def meshes(fitted: FittedFrame) -> dict[int, int]:
    """Action of each id's marker."""
    markers: list[Any] = [
        deserialize_message(message, Marker) if isinstance(message, bytes) else message
        for name, message in fitted.outputs if name == MESH]
    return {marker.id: marker.action for marker in markers}


def test_a_loop_of_a_recording_removes_the_old_ids_and_gives_new_ones(
    recording: Recording
) -> None:
    fitter = fitter_of(recording)
    frames = [scene.frame for scene in recording.scenes]
    first = [fit(fitter, frame) for frame in frames]
    assert [meshes(fitted) for fitted in first] == [{0: Marker.ADD}] * len(frames)
    assert first[-1].result.bodies[0].track.state is TrackState.TRACKED
    again = fit(fitter, frames[0])
    assert meshes(again) == {0: Marker.DELETE, 1: Marker.ADD}
    assert again.result.bodies[0].track.state is TrackState.NEW


def test_a_reset_gives_the_first_id_again(recording: Recording) -> None:
    fitter = fitter_of(recording)
    fit(fitter, recording.scenes[0].frame)
    fitter.reset()
    assert meshes(fit(fitter, recording.scenes[1].frame)) == {0: Marker.ADD}


def test_a_replay_that_is_started_again_after_its_first_frame_shows_it_again(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    fitter, frame = fitter_of(recording), recording.scenes[0].frame
    assert meshes(fit(fitter, frame)) == {0: Marker.ADD}
    with pytest.raises(RepeatedStampError):
        fit(fitter, frame)
    monkeypatch.setattr(frame_fitter, 'PAUSE_S', 0.0)
    assert meshes(fit(fitter, frame)) == {0: Marker.DELETE, 1: Marker.ADD}


def test_without_tracking_each_frame_stands_alone(recording: Recording) -> None:
    fitter = fitter_of(recording, NodeConfig(tracking=TrackingConfig(enabled=False)))
    found = [fit(fitter, scene.frame) for scene in recording.scenes[:2]]
    assert [meshes(fitted) for fitted in found] == [{0: Marker.ADD}] * 2
    assert all(fitted.result.bodies[0].track is None for fitted in found)
