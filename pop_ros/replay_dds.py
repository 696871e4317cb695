"""Play a bag over DDS to a node in another process and record what it publishes."""

from __future__ import annotations

import signal
import struct
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from pop_core.errors import PopError
from pop_ros.bag_reader import BagReader
from pop_ros.bag_topics import RgbdTopics
from pop_ros.bag_writer import BagWriter
from pop_ros.body_messages import RECORDED_TYPES
from pop_ros.diagnostics import DROP_PREFIX, MISSED, RECEIVED, WHY_MISSED, read_values
from pop_ros.inputs import COLOR, DEPTH, INFO, TRANSPORTS
from pop_ros.node_arguments import SourceArguments
from pop_ros.qos import output_qos
from pop_ros.replay import KINDS, OUTPUT_NAMESPACE, ReplaySummary, announce_outputs

READY_S = 900.0  # a first start generates the pose library
IDLE_S = 300.0  # the frame in work and the one that waits
SETTLE_S = 1.5  # two reports of the node must agree that nothing is pending
LOST_S = 10.0  # messages that have not arrived by then are lost
STOP_S = 15.0
NODE_NAME = '/pop'


class ReplayError(PopError):
    """A node that does not come up, or ends while a bag is played."""


class NodeProcess:
    """The node in a process of its own."""

    def __init__(self, sources: SourceArguments, slop_s: float) -> None:
        """Start it; it inherits the environment, so both sides share domain and RMW."""
        command = [
            sys.executable, '-m', 'pop_ros.node', *sources.as_flags(),
            '--ros-args', '-p', f'sync.slop_s:={slop_s:.9f}']
        self._process = subprocess.Popen(command)

    def check(self) -> None:
        """Raise ReplayError if it has ended."""
        code = self._process.poll()
        if code is not None:
            raise ReplayError(f'replay: expected the node to run, found that it ended with {code}')

    def stop(self) -> int:
        """Ask it to end as Ctrl-C does; return its exit code."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        try:
            return self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            return self._process.wait()


def bag_transports(bag: BagReader, topics: RgbdTopics) -> dict[str, tuple[str, type]]:
    """Return topic suffix and message type with which each role's messages are published."""
    kinds = {topic.name: topic.kind for topic in bag.topics}
    named = {COLOR: topics.color, DEPTH: topics.depth, INFO: topics.info}
    return {
        role: next((suffix, kind) for suffix, kind in TRANSPORTS[role]
                   if kinds[topic].endswith(f'/{kind.__name__}'))
        for role, topic in named.items()}


class DdsPlayer:
    """Publishes a bag's images and records the node's outputs."""

    def __init__(
        self, transports: Mapping[str, tuple[str, type]], check: Callable[[], None]
    ) -> None:
        """Join the ROS graph.

        Args:
            transports: Topic suffix and message type by role.
            check: Raises when there is no point in going on.
        """
        self._check = check
        self._writer: BagWriter | None = None
        self._values: dict[str, str] = {}
        self._before: dict[str, str] = {}
        self._published: Counter[str] = Counter()
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('pop_replay', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._publishers = {
            role: self._node.create_publisher(kind, f'{role}{suffix}', 10)
            for role, (suffix, kind) in transports.items()}
        for name, kind in RECORDED_TYPES.items():
            self._node.create_subscription(
                kind, f'{OUTPUT_NAMESPACE}/{name}', self._recorder(name), output_qos(), raw=True)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._on_report, 10)

    def __enter__(self) -> DdsPlayer:
        """Return the player."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=self._context)

    def wait_until_subscribed(self, timeout_s: float) -> None:
        """Wait until the node has subscribed all inputs, which it does once it is ready.

        Raises:
            ReplayError: If it does not within `timeout_s`.
        """
        def is_ready() -> bool:
            subscribed = all(p.get_subscription_count() for p in self._publishers.values())
            return subscribed and bool(self._values)

        if not self._spin(timeout_s, is_ready):
            raise ReplayError(
                f'replay: expected a node that subscribes {", ".join(self._publishers)} within '
                f'{timeout_s:.0f} s, found none: is it running in this ROS_DOMAIN_ID?')

    def record_into(self, writer: BagWriter) -> None:
        """Write every output from now on into an open bag, and count from now on."""
        self._before = self._values
        announce_outputs(writer)
        self._writer = writer

    def play(
        self, bag: BagReader, topics: RgbdTopics, rate: float, on_message: Callable[[], None]
    ) -> int:
        """Publish the bag's messages at `rate` times their own pace; return their number."""
        roles = {topics.color: COLOR, topics.depth: DEPTH, topics.info: INFO}
        started_s = first_ns = None
        for message in bag.messages(topics.all):
            if started_s is None or first_ns is None:
                started_s, first_ns = time.monotonic(), message.time_ns
            due_s = started_s + (message.time_ns - first_ns) / 1e9 / rate
            self._spin(due_s - time.monotonic(), lambda: False)
            role = roles[message.topic]
            self._publishers[role].publish(message.data)
            self._published[role] += 1
            on_message()
        return self._published.total()

    def finish(self, summary: ReplaySummary) -> None:
        """Wait until the node has nothing left to do and take over its counts."""
        lost_at_s = time.monotonic() + LOST_S
        busy_at_s = time.monotonic()

        def is_idle() -> bool:
            nonlocal busy_at_s
            arrived = all(
                self._count(f'{RECEIVED}{role}') >= n for role, n in self._published.items())
            waits = not arrived and time.monotonic() < lost_at_s
            if waits or self._values.get('pending') != '0':
                busy_at_s = time.monotonic()
            return time.monotonic() - busy_at_s > SETTLE_S

        if not self._spin(IDLE_S, is_idle):
            summary.notes.append(f'the node was still busy after {IDLE_S:.0f} s')
        summary.pairs = self._count('pairs')
        summary.frames = self._count('frames')
        summary.people = self._count('people')
        summary.latency_text = self._values.get('latency (pair to published)', '-')
        missed = self._count(MISSED)
        if missed:
            summary.notes.append(f'{missed} {MISSED}: {self._values.get(WHY_MISSED, "")}')
        for key in self._values:
            if key.startswith(DROP_PREFIX) and self._count(key):
                summary.drops[key[len(DROP_PREFIX):]] = self._count(key)

    def _count(self, key: str) -> int:
        """Return what a count of the node has grown by since the recording began."""
        return int(self._values.get(key, 0)) - int(self._before.get(key, 0))

    def _spin(self, timeout_s: float, done: Callable[[], bool]) -> bool:
        """Handle messages until `done` or the time is over; return whether it was done."""
        end_s = time.monotonic() + timeout_s
        while not (finished := done()):
            left_s = end_s - time.monotonic()
            if left_s <= 0:
                return False
            self._check()
            self._executor.spin_once(timeout_sec=min(left_s, 0.05))
        return finished

    def _recorder(self, name: str) -> Callable[[bytes], None]:
        def record(data: bytes) -> None:
            # Every output starts with a header, and that with its stamp.
            sec, nanosec = struct.unpack_from('<iI', data, 4)
            time_ns = sec * 1_000_000_000 + nanosec
            if self._writer is None:
                return
            self._writer.write(f'{OUTPUT_NAMESPACE}/{name}', KINDS[name], time_ns, bytes(data))
        return record

    def _on_report(self, message: Any) -> None:
        self._values = read_values(message, NODE_NAME) or self._values
