"""A fault of the node itself is counted, told and survived."""

from collections.abc import Iterator

import pytest
import rclpy
from rclpy.lifecycle import LifecycleNode
from support.camera_cases import PLAIN, build
from support.player import Listener

from pop_core.config import PipelineConfig
from pop_core.keypoints.detection import Detection
from pop_core.rgbd import RgbdFrame
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


@pytest.fixture
def node() -> Iterator[LifecycleNode]:
    rclpy.init()
    made = LifecycleNode('pop')
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def test_frames_after_a_fault_are_fitted_and_the_fault_is_counted(
    node: LifecycleNode, capfd: pytest.CaptureFixture[str]
) -> None:
    statistics, detector = NodeStatistics(), Faulty()
    settings = ConfigParameters(node, NodeConfig(lazy=False), PipelineConfig(), lambda: None)
    work = FrameWork(
        node, settings, detector, StaticFrames(), NodeOutputs(node), statistics)
    color, depth, info = build(next(iter(PLAIN)), 0)
    with Listener() as clock:
        assert clock.spin_until(lambda: work.is_ready, 120)
        work.run(True)
        for count in range(1, 7):
            work.put(RgbdMessages(color, depth, info, 0.0))
            assert clock.spin_until(lambda: statistics.snapshot().pending == 0, 10)
            assert detector.calls == count
    assert work.stop(10)
    snapshot = statistics.snapshot()
    assert (snapshot.frames, snapshot.faults, snapshot.refused) == (3, 3, 3)
    assert snapshot.drops == {'zero division': 3}
    # Said once, not with every frame.
    assert capfd.readouterr().err.count('frame failed (zero division)') == 1
    assert work.failure is None
