"""Look after the node once a second: explain silence in the log, publish /diagnostics."""

from __future__ import annotations

import time

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node

from pop_ros.diagnostics import Report, diagnostic_array
from pop_ros.explanation import explain_missing_keypoints, explain_missing_pairs
from pop_ros.inputs import RgbdInputs
from pop_ros.node_config import DiagnosticsConfig
from pop_ros.statistics import NodeStatistics, Snapshot
from pop_ros.to_messages import make_header

SILENCE_S = 5.0  # of images, and of the keypoint source


class NodeHealth:
    """Compares what was done since the last report with what is expected."""

    def __init__(self, node: Node, inputs: RgbdInputs, statistics: NodeStatistics) -> None:
        """Advertise /diagnostics."""
        self._node, self._inputs, self._statistics = node, inputs, statistics
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self._previous: Snapshot | None = None
        self._troubles: dict[str, str] = {}

    def report(
        self, limits: DiagnosticsConfig, *, state: str, doing: str, waits: bool,
        looking_s: float,
    ) -> None:
        """Publish a report, and log what keeps the node from working when that is news.

        Args:
            limits: Values that deserve a warning.
            state: State of the life cycle.
            doing: What is being prepared; '' when nothing is.
            waits: Whether frames are expected.
            looking_s: For how long an answer of the keypoint source is waited for [s].
        """
        reports = self._inputs.reports()
        silence_s = time.monotonic() - self._inputs.last_frame_s
        troubles = {}
        if waits and silence_s > SILENCE_S:
            troubles['images'] = explain_missing_pairs(reports, self._inputs.pairer, silence_s)
        if looking_s > SILENCE_S:
            troubles['keypoints'] = explain_missing_keypoints(looking_s)
        for what in troubles.keys() - self._troubles.keys():
            self._node.get_logger().warning(troubles[what])  # type: ignore[no-untyped-call]
        self._troubles = troubles
        snapshot = self._statistics.snapshot()
        now = Report(
            snapshot, self._previous, self._inputs.pairer, reports, limits, state=state,
            doing=doing, waits=waits, troubles=tuple(troubles.values()))
        header = make_header(self._node.get_clock().now().nanoseconds, '')
        self._publisher.publish(
            diagnostic_array(header, self._node.get_fully_qualified_name(), now))
        self._previous = snapshot
