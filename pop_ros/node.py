"""Run the ROS 2 node `pop`: RGB-D in, bodies out."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Sequence
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pop_ros.node_arguments import NodeArguments

OK, FAILED, BAD_USAGE = 0, 1, 2
# The worker lets go of the interpreter for each kernel, and would wait ten times as long (Python's
# own 5 ms) until a thread that receives images or looks for people gives it back: a fifth of its
# frames' time.
SWITCH_S = 0.0005


def main(argv: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the process's exit code."""
    stopping = threading.Event()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        stopping.set()

    # Before the imports, which take a second: whoever stops the node in it gets a clean end too.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    import rclpy
    from rclpy.signals import SignalHandlerOptions
    from rclpy.utilities import remove_ros_args

    from pop_ros.node_arguments import parse_arguments

    argv = list(sys.argv if argv is None else ['pop_node', *argv])
    arguments = parse_arguments(remove_ros_args(argv)[1:])
    # The first matching rule wins, so that the user's own remappings come before the preset's.
    rclpy.init(
        args=argv + arguments.as_remappings(), signal_handler_options=SignalHandlerOptions.NO)
    try:
        return _run(arguments, stopping)
    finally:
        rclpy.try_shutdown()  # type: ignore[attr-defined]


def _run(arguments: NodeArguments, stopping: threading.Event) -> int:
    from rclpy.executors import SingleThreadedExecutor

    from pop_core.errors import PopError
    from pop_ros.body_node import PopNode

    sys.setswitchinterval(SWITCH_S)
    try:
        node = PopNode(arguments)
        node.start()
    except PopError as error:
        sys.stderr.write(f'pop node: {error}\n')
        return BAD_USAGE
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not stopping.is_set() and node.failure is None:
        # The timers wake the wait 20 times a second; Python's signal handlers run in between.
        executor.spin_once()
    failure = node.failure
    finished = node.stop()
    if failure is not None:
        sys.stderr.write(f'pop node: {failure}\n')
    code = OK if failure is None else BAD_USAGE if isinstance(failure, PopError) else FAILED
    if not finished:
        # Tearing down the interpreter under a thread that still computes would crash it.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    executor.shutdown()
    node.destroy_node()  # type: ignore[no-untyped-call]
    return code


if __name__ == '__main__':
    sys.exit(main())
