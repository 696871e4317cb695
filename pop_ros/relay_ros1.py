"""Pass the node's standard messages on to ROS 1, live: ros1_bridge does not support Jazzy.

One process cannot hold rclpy and rospy, which come with different Pythons: this side subscribes,
converts and writes into a pipe; `relay_ros1_side` reads and publishes.
"""

from __future__ import annotations

import json
import os
import queue
import struct
import subprocess
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

from rclpy.node import Node

from pop_core.errors import PopError
from pop_ros import relay_ros1_side
from pop_ros.body_messages import CLOUD, JOINTS, MESH, RECORDED_TYPES
from pop_ros.qos import output_qos
from pop_ros.replay import KINDS
from pop_ros.ros1_conversion import ROS1_STORE, cdr_to_ros1

RELAYED = (MESH, JOINTS, CLOUD)
READY_S = 15.0
STOP_S = 5.0
# Of another ROS or Python than the other side's; its master's address is kept.
FOREIGN = ('PYTHON', 'AMENT_', 'VIRTUAL_ENV', 'LD_LIBRARY_PATH', 'ROS_DISTRO', 'ROS_VERSION',
           'ROS_PYTHON_VERSION')


class RelayError(PopError):
    """A ROS 1 side that does not start or has ended."""


@dataclass(frozen=True, slots=True)
class RelayedTopic:
    """A topic that is passed on under the same name.

    Args:
        name: Topic.
        kind: Type in the form 'sensor_msgs/msg/PointCloud2'.
        message: Message class of ROS 2.
    """

    name: str
    kind: str
    message: type


def node_topics(node_name: str) -> list[RelayedTopic]:
    """Return the standard topics of a pop node, such as '/pop'."""
    return [RelayedTopic(f'{node_name}/{name}', KINDS[name], RECORDED_TYPES[name])
            for name in RELAYED]


class Ros1Side:
    """The process that publishes on ROS 1."""

    def __init__(self, python: Path, topics: Sequence[RelayedTopic]) -> None:
        """Start it and wait until it has found its master.

        Raises:
            RelayError: If it does not come up.
        """
        environment = {k: v for k, v in os.environ.items() if not k.startswith(FOREIGN)}
        try:
            self._process = subprocess.Popen(
                [str(python), str(Path(relay_ros1_side.__file__))], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, env=environment, start_new_session=True)
        except OSError as error:
            raise RelayError(f'{python}: expected a Python with rospy, found {error}') from None
        kinds = [_definition(topic) for topic in topics]
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(kinds).encode() + b'\n')
            self._process.stdin.flush()
            self._wait_until_ready(python)
        except BaseException:
            self.stop()
            raise

    def send(self, number: int, data: bytes) -> None:
        """Publish a message, as ROS 1 serialises it, on a topic.

        Raises:
            RelayError: If the process has ended.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(struct.pack(relay_ros1_side.RECORD, number, len(data)))
            self._process.stdin.write(data)
            self._process.stdin.flush()
        except BrokenPipeError:
            raise RelayError(
                f'relay: expected the ROS 1 side to run, found that it ended with '
                f'{self._process.wait(STOP_S)}') from None

    def stop(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):  # it has ended already
            self._process.stdin.close()
        try:
            self._process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _wait_until_ready(self, python: Path) -> None:
        said: queue.Queue[bytes] = queue.Queue()
        stdout = self._process.stdout
        assert stdout is not None
        threading.Thread(target=lambda: said.put(stdout.readline()), daemon=True).start()
        try:
            line = said.get(timeout=READY_S)
        except queue.Empty:
            master = os.environ.get('ROS_MASTER_URI', 'http://localhost:11311')
            raise RelayError(
                f'relay: expected a ROS 1 master at {master} within {READY_S:.0f} s, found none: '
                'start roscore, or set ROS_MASTER_URI') from None
        if line != relay_ros1_side.READY:
            raise RelayError(
                f'{python}: expected a Python with rospy, found one that ended with '
                f'{self._process.wait(STOP_S)}: apt-get install python3-rospy, or name another '
                'one with --python')


def _definition(topic: RelayedTopic) -> tuple[str, str, str, str]:
    """Return name, type, checksum and text of a topic's type, as ROS 1 has them."""
    text, md5 = ROS1_STORE.generate_msgdef(topic.kind, ros_version=1)
    return topic.name, topic.kind.replace('/msg/', '/'), md5, text


class Relay:
    """Subscriptions on ROS 2 whose messages go to the ROS 1 side."""

    def __init__(self, node: Node, side: Ros1Side, topics: Sequence[RelayedTopic]) -> None:
        """Subscribe all topics."""
        self._side = side
        self.counts: Counter[str] = Counter()
        for number, topic in enumerate(topics):
            node.create_subscription(
                topic.message, topic.name, self._passer(number, topic), output_qos(), raw=True)

    def __enter__(self) -> Relay:
        """Return the relay."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """End the ROS 1 side."""
        self._side.stop()

    def _passer(self, number: int, topic: RelayedTopic) -> Callable[[bytes], None]:
        def pass_on(data: bytes) -> None:
            self._side.send(number, cdr_to_ros1(bytes(data), topic.kind))
            self.counts[topic.name] += 1
        return pass_on
