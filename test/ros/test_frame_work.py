"""A fault of the node itself is counted, told and survived."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
import rclpy
from builtin_interfaces.msg import Time
from rclpy.lifecycle import LifecycleNode
from support.camera_cases import PLAIN, build
from support.faults import divide_by_zero, take_for_ever
from support.messages import camera_info, depth_image, image
from support.player import Listener
from support.recording import Recording, record

from pop_core.config import PipelineConfig
from pop_core.tracking import looks
from pop_ros import looking
from pop_ros.frame_fitter import FrameFitter
from pop_ros.frame_work import FrameWork
from pop_ros.inputs import RgbdMessages
from pop_ros.node_arguments import NodeArguments, SourceArguments
from pop_ros.node_config import NodeConfig
from pop_ros.node_outputs import NodeOutputs
from pop_ros.parameters import ConfigParameters
from pop_ros.static_frames import StaticFrames
from pop_ros.statistics import NodeStatistics

READY_S = 300.0  # a first start draws the pose library and compiles kernels


def prepared(
    node: LifecycleNode, keypoints: Path
) -> tuple[FrameWork, NodeStatistics]:
    """Return the work of a node that always works, and what it counts."""
    statistics = NodeStatistics()
    settings = ConfigParameters(node, NodeConfig(lazy=False), PipelineConfig(), lambda: None)
    work = FrameWork(
        node, settings, NodeArguments(SourceArguments('json', keypoints)), StaticFrames(),
        NodeOutputs(node), statistics)
    return work, statistics


def messages(recording: Recording, number: int) -> RgbdMessages:
    """Return a frame of a recording, counted from 1, as its camera sends it."""
    frame, stamp = recording.scenes[number - 1].frame, recording.stamps[number - 1]
    return RgbdMessages(
        image(frame.rgb, 'rgb8', stamp), depth_image(frame.depth_m, '16UC1', stamp),
        camera_info(frame.camera, stamp), 0.0, number=number)


def after_pairs(
    node: LifecycleNode, recording: Recording, numbers: Sequence[int]
) -> NodeStatistics:
    """Return what a node has counted that got these frames, each once the last was done with."""
    work, statistics = prepared(node, recording.keypoints)
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, READY_S)
        work.run(True)
        for number in numbers:
            work.put(messages(recording, number))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 20)
    assert work.stop(10)
    return statistics


@pytest.fixture
def node() -> Iterator[LifecycleNode]:
    rclpy.init()
    # Not called pop: services of a life cycle outlive destroy_node until they are collected, and
    # another test would ask them in place of its own node.
    made = LifecycleNode('pop_at_work')
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def test_frames_after_a_fault_are_fitted_and_the_fault_is_counted(
    node: LifecycleNode, capfd: pytest.CaptureFixture[str], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for second in range(1, 7):  # far enough apart that each is looked at, though nobody is there
        (tmp_path / f'{second}000000000.json').write_text('{"people": []}')
    work, statistics = prepared(node, tmp_path)
    color, depth, info = build(next(iter(PLAIN)), 0)
    sees = looks.look_for_people
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, READY_S)
        work.run(True)
        for count in range(1, 7):
            color.header.stamp = depth.header.stamp = info.header.stamp = Time(sec=count)
            monkeypatch.setattr(looks, 'look_for_people', divide_by_zero if count % 2 else sees)
            work.put(RgbdMessages(color, depth, info, 0.0))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 10)
        monkeypatch.setattr(looking, '_detect', divide_by_zero)
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
    statistics = after_pairs(node, recording, (1, 2, 3, 6))
    assert statistics.snapshot().frames == 4
    # The sixth lies 0.2 s behind the third, as from a camera of 5 Hz, all of whose frames count.
    assert told == [0, 0, 0, 2]


def test_people_are_followed_while_the_keypoint_source_thinks(
    node: LifecycleNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = record(tmp_path, n_frames=12, rate_hz=15.0)
    work, statistics = prepared(node, recording.keypoints)
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, READY_S)
        work.run(True)
        for number in range(1, 13):
            if number == 3:
                monkeypatch.setattr(looks, 'look_for_people', take_for_ever)
            work.put(messages(recording, number))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 20)
        assert statistics.snapshot().frames == 12
        assert work.looking_s > 0.0  # it was asked, and has not answered
    assert work.stop(20)
    assert statistics.snapshot().refused == 0


def test_a_frame_that_waits_for_a_stuck_source_is_given_up_at_the_end(
    node: LifecycleNode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = record(tmp_path, n_frames=1, rate_hz=15.0)
    monkeypatch.setattr(looks, 'look_for_people', take_for_ever)
    work, statistics = prepared(node, recording.keypoints)
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, READY_S)
        work.run(True)
        work.put(messages(recording, 1))
        assert clock.spin_until(lambda: work.looking_s > 0.0, 20)
    assert work.stop(0.1)
    assert statistics.snapshot().drops == {'finding': 1}


def test_a_pair_that_comes_twice_is_dropped_and_explained(
    node: LifecycleNode, tmp_path: Path
) -> None:
    recording = record(tmp_path, n_frames=3, rate_hz=15.0)
    snapshot = after_pairs(node, recording, (1, 2, 2, 3)).snapshot()
    assert (snapshot.frames, snapshot.faults, snapshot.drops) == (3, 0, {'repeated stamp': 1})
    assert 'the same frame again' in snapshot.latest_drop
