"""A fault of the node itself is counted, told and survived."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import rclpy
from rclpy.lifecycle import LifecycleNode
from support.camera_cases import PLAIN, build
from support.messages import camera_info, depth_image, image
from support.player import Listener
from support.recording import Recording, record

from pop_core.config import PipelineConfig
from pop_core.errors import PopError
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.openpose_json import OpenPoseJsonDetector
from pop_core.rgbd import RgbdFrame
from pop_ros.frame_fitter import FrameFitter
from pop_ros.frame_work import FrameWork
from pop_ros.inputs import RgbdMessages
from pop_ros.node_config import NodeConfig
from pop_ros.node_outputs import NodeOutputs
from pop_ros.parameters import ConfigParameters
from pop_ros.static_frames import StaticFrames
from pop_ros.statistics import NodeStatistics


class Faulty:
    """A keypoint source with a bug in every other frame."""

    def __init__(self) -> None:
        self.calls = 0

    def detect(self, _frame: RgbdFrame) -> list[Detection]:
        self.calls += 1
        if self.calls % 2:
            raise ZeroDivisionError('division by zero')
        return []


class Stuck(OpenPoseJsonDetector):
    """A keypoint source that takes its time after some answers, and is then told to go on."""

    def __init__(self, folder: Path, answers: int) -> None:
        super().__init__(folder)
        self.left, self.go_on = answers, threading.Event()

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        self.left -= 1
        if self.left < 0:
            self.go_on.wait(60.0)
        return super().detect(frame)


def prepared(
    node: LifecycleNode, detector: KeypointDetector
) -> tuple[FrameWork, NodeStatistics]:
    """Return the work of a node that always works, and what it counts."""
    statistics = NodeStatistics()
    settings = ConfigParameters(node, NodeConfig(lazy=False), PipelineConfig(), lambda: None)
    work = FrameWork(
        node, settings, detector, StaticFrames(), NodeOutputs(node), statistics)
    return work, statistics


def messages(recording: Recording, number: int) -> RgbdMessages:
    """Return a frame of a recording, counted from 1, as its camera sends it."""
    frame, stamp = recording.scenes[number - 1].frame, recording.stamps[number - 1]
    return RgbdMessages(
        image(frame.rgb, 'rgb8', stamp), depth_image(frame.depth_m, '16UC1', stamp),
        camera_info(frame.camera, stamp), 0.0, number=number)


@pytest.fixture
def node() -> Iterator[LifecycleNode]:
    rclpy.init()
    made = LifecycleNode('pop')
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def test_frames_after_a_fault_are_fitted_and_the_fault_is_counted(
    node: LifecycleNode, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    detector = Faulty()
    work, statistics = prepared(node, detector)
    color, depth, info = build(next(iter(PLAIN)), 0)
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, 120)
        work.run(True)
        for count in range(1, 7):
            work.put(RgbdMessages(color, depth, info, 0.0))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 10)
            assert detector.calls == count
        answer = work.snapshot(tmp_path)
        assert clock.spin_until(answer.done, 10)
        assert answer.result() == (False, 'division by zero')
    assert work.stop(10)
    snapshot = statistics.snapshot()
    assert (snapshot.frames, snapshot.faults, snapshot.refused) == (3, 3, 3)
    assert snapshot.drops == {'zero division': 3}
    # Said once, not with every frame.
    assert capfd.readouterr().err.count('frame failed (zero division)') == 1
    assert work.failure is None


def test_frames_that_nobody_had_time_for_do_not_make_a_camera_slow(
    node: LifecycleNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = record(tmp_path, n_frames=6, rate_hz=15.0)
    told, fit = [], FrameFitter.fit
    monkeypatch.setattr(
        FrameFitter, 'fit',
        lambda *args, skipped, **named: told.append(skipped) or fit(
            *args, skipped=skipped, **named))
    work, statistics = prepared(node, OpenPoseJsonDetector(recording.keypoints))
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, 120)
        work.run(True)
        for number in (1, 2, 3, 6):
            work.put(messages(recording, number))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 20)
    assert work.stop(10)
    assert statistics.snapshot().frames == 4
    # The sixth lies 0.2 s behind the third, as from a camera of 5 Hz, all of whose frames count.
    assert told == [0, 0, 0, 2]


def test_people_are_followed_while_the_keypoint_source_thinks(
    node: LifecycleNode, tmp_path: Path
) -> None:
    recording = record(tmp_path, n_frames=12, rate_hz=15.0)
    detector = Stuck(recording.keypoints, answers=2)
    work, statistics = prepared(node, detector)
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, 120)
        work.run(True)
        for number in range(1, 13):
            work.put(messages(recording, number))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 20)
        assert detector.left < 0  # it was asked, and has not answered
        assert statistics.snapshot().frames == 12
        assert work.looking_s > 0.0
        detector.go_on.set()
        assert work.stop(20)
    assert statistics.snapshot().refused == 0


def test_at_the_end_frame_and_look_share_one_patience(
    node: LifecycleNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on, asked = threading.Event(), threading.Event()

    def slow(fitter: FrameFitter, *_: object, **__: object) -> None:
        fitter._looking.submit(go_on.wait)
        asked.set()
        time.sleep(0.7)
        raise PopError('in vain')

    monkeypatch.setattr(FrameFitter, 'fit', slow)
    work, _ = prepared(node, Faulty())
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, 120)
        work.run(True)
        work.put(RgbdMessages(*build(next(iter(PLAIN)), 0), 0.0))
        assert asked.wait(20)
    began_s = time.monotonic()
    assert not work.stop(1.0)
    assert time.monotonic() - began_s < 1.4  # and not 0.7 s and another second
    go_on.set()
