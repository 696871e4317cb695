"""Play a bag over DDS to a node in another process and record what it publishes."""

from __future__ import annotations

import struct
import time
from collections import Counter
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from pop_ros.bag_topics import RgbdTopics
from pop_ros.bag_writer import BagWriter
from pop_ros.body_messages import RECORDED_TYPES
from pop_ros.diagnostics import DROP_PREFIX, MISSED, RECEIVED, WHY_MISSED, read_values
from pop_ros.inputs import COLOR, DEPTH, INFO, TRANSPORTS
from pop_ros.qos import output_qos
from pop_ros.recording import Recording
from pop_ros.replay import KINDS, OUTPUT_NAMESPACE, ReplaySummary, announce_outputs
from pop_ros.replay_node import ReplayError
from pop_ros.replay_pace import BagClock, EnterKey, Pace

READY_S = 900.0  # a first start generates the pose library
IDLE_S = 300.0  # the frame in work and the one that waits
SETTLE_S = 1.5  # two reports of the node must agree that nothing is pending
LOST_S = 10.0  # messages that have not arrived by then are lost
CLOCK_PERIOD_S = 0.01
NODE_NAME = '/pop'


def bag_transports(bag: Recording, topics: RgbdTopics) -> dict[str, tuple[str, type]]:
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
        self, transports: Mapping[str, tuple[str, type]], check: Callable[[], None], pace: Pace
    ) -> None:
        """Join the ROS graph.

        Args:
            transports: Topic suffix and message type by role.
            check: Raises when there is no point in going on.
            pace: How to play.
        """
        self._check = check
        self._clock = BagClock(pace.rate)
        self._enter = EnterKey() if pace.step else None
        self._time_of_stamp: dict[int, int] = {}
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
        if pace.clock:
            self._time = self._node.create_publisher(Clock, '/clock', 1)
            self._node.create_timer(CLOCK_PERIOD_S, self._publish_time)

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

    def stop_recording(self) -> None:
        """Write nothing more."""
        self._writer = None

    @property
    def published(self) -> int:
        """Return how many messages were published."""
        return self._published.total()

    def play(
        self, bag: Recording, topics: RgbdTopics, on_message: Callable[[], None]
    ) -> None:
        """Publish the bag's messages at their pace."""
        roles = {topics.color: COLOR, topics.depth: DEPTH, topics.info: INFO}
        self._clock.rewind()
        for message in bag.messages(topics.all):
            role = roles[message.topic]
            if role == COLOR:
                self._wait_for_enter()
                self._time_of_stamp[_stamp_ns(message.data)] = message.time_ns
            self._clock.go_on(message.time_ns)
            self._spin(self._clock.seconds_until(message.time_ns), lambda: False)
            self._publishers[role].publish(message.data)
            self._published[role] += 1
            on_message()
        self._clock.pause()

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

    def _wait_for_enter(self) -> None:
        """Let a frame that waits for the Enter key wait, and the time of the recording stand."""
        if self._enter is not None:
            self._clock.pause()
            while not self._spin(1.0, self._enter.may_pass):
                pass

    def _publish_time(self) -> None:
        now_ns = self._clock.now_ns()
        if now_ns is not None:
            sec, nanosec = divmod(now_ns, 1_000_000_000)
            self._time.publish(Clock(clock=Time(sec=sec, nanosec=nanosec)))

    def _recorder(self, name: str) -> Callable[[bytes], None]:
        def record(data: bytes) -> None:
            if self._writer is not None:
                stamp_ns = _stamp_ns(data)
                time_ns = self._time_of_stamp.get(stamp_ns, stamp_ns)
                self._writer.write(
                    f'{OUTPUT_NAMESPACE}/{name}', KINDS[name], time_ns, bytes(data))
        return record

    def _on_report(self, message: Any) -> None:
        self._values = read_values(message, NODE_NAME) or self._values


def _stamp_ns(data: bytes) -> int:
    """Return the stamp of a stored message [ns]: images and outputs begin with their header."""
    sec, nanosec = struct.unpack_from('<iI', data, 4)
    return int(sec * 1_000_000_000 + nanosec)
