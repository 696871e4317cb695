"""What keeps the node from working is said once when it begins, and shown while it lasts."""

from collections.abc import Iterator

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.node import Node
from support.player import Listener

from pop_ros.health import SILENCE_S, NodeHealth
from pop_ros.inputs import RgbdInputs
from pop_ros.node_config import DiagnosticsConfig
from pop_ros.statistics import NodeStatistics


@pytest.fixture
def node() -> Iterator[Node]:
    rclpy.init()
    made = Node('pop')
    yield made
    made.destroy_node()
    rclpy.try_shutdown()


def test_a_keypoint_source_that_hangs_is_warned_of_once_each_time(
    node: Node, capfd: pytest.CaptureFixture[str]
) -> None:
    inputs = RgbdInputs(node, 0.0, lambda _messages: None)
    health = NodeHealth(node, inputs, NodeStatistics())
    with Listener() as listener:
        reports: list[DiagnosticArray] = []
        listener.node.create_subscription(
            DiagnosticArray, '/diagnostics', reports.append, 10)
        assert listener.spin_until(lambda: node.count_subscribers('/diagnostics') == 1, 10)
        for looking_s in (0.1, SILENCE_S + 1.0, SILENCE_S + 2.0, 0.1, SILENCE_S + 1.0):
            health.report(
                DiagnosticsConfig(), state='active', doing='', waits=False, looking_s=looking_s)
        assert listener.spin_until(lambda: len(reports) == 5, 10)
    assert [report.status[0].level for report in reports] == [
        DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.WARN,
        DiagnosticStatus.OK, DiagnosticStatus.WARN]
    assert 'has not answered for 7 s' in reports[2].status[0].message
    assert capfd.readouterr().err.count('keypoint source has not answered for 6 s') == 2
