"""`pop relay-ros1`: the node's outputs on ROS 1, live."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer


def relay_ros1(
    node: Annotated[str, typer.Option('--node', help='Full name of the pop node.')] = '/pop',
    python: Annotated[Path, typer.Option(
        '--python', help='A Python that has rospy.')] = Path('/usr/bin/python3'),
) -> None:
    """Pass mesh, joints and points of a running node on to the ROS 1 master of ROS_MASTER_URI."""
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor

    from pop_ros.relay_ros1 import Relay, Ros1Side, node_topics

    topics = node_topics(node)
    side = Ros1Side(python, topics)
    context = Context()
    rclpy.init(context=context)
    ros2 = rclpy.create_node('pop_relay_ros1', context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(ros2)
    with Relay(ros2, side, topics) as relay:
        for topic in topics:
            typer.echo(f'{topic.name} ({topic.kind}) -> ROS 1')
        with suppress(KeyboardInterrupt):
            executor.spin()
    counted = ', '.join(f'{count} of {name}' for name, count in sorted(relay.counts.items()))
    typer.echo(f'passed on {counted or "nothing"}')
    executor.shutdown()
    rclpy.shutdown(context=context)
