"""`pop viewer`: show the bodies of a pop node in rviz on another machine."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.utilities import remove_ros_args

from pop_core.errors import PopError
from pop_ros.model_files import ModelFiles
from pop_ros.node_config import MESH_DETAILS, MeshConfig
from pop_ros.viewer_node import ViewerNode

OK, BAD_USAGE = 0, 2
ABOUT = """Show the bodies of a pop node on another machine.

Subscribes NODE/bodies and NODE/body_model (pop_msgs; about 3 kB per person and frame), poses the
same body model here, and publishes the meshes as Markers on /pop_viewer/mesh. Works only while
somebody watches them. Where the models differ nothing is shown, and the log says so.
"""
EPILOG = 'ROS arguments go last: pop viewer --node /front/pop --ros-args -r ~/mesh:=/mesh'


def parse_arguments(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the arguments of a command line without its ROS part; exits with 2 on a bad one."""
    parser = argparse.ArgumentParser(
        prog='pop viewer', description=ABOUT, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--node', default='/pop', metavar='NAME',
                        help='full name of the pop node (default: /pop)')
    parser.add_argument('--body', '--model', dest='body', type=Path, metavar='FILE',
                        help='the body model the node fits (its --body), where it is not the '
                             'default one')
    parser.add_argument('--detail', choices=[d for d in MESH_DETAILS if d != 'off'],
                        default='full', help='mesh to publish (default: full)')
    parser.add_argument('--lifetime-s', type=float, default=0.0, metavar='SECONDS',
                        help='rviz removes a mesh that is not renewed for so long; 0 keeps it')
    found = parser.parse_args(arguments)
    if not found.node.startswith('/'):
        parser.error(f"--node: expected a full name such as /pop, found '{found.node}'")
    if not 0 <= found.lifetime_s <= 3600:
        parser.error(f'--lifetime-s: expected 0 to 3600 seconds, found {found.lifetime_s:g}')
    return found


def main(argv: Sequence[str] | None = None) -> int:
    """Run the viewer until SIGINT or SIGTERM; return the process's exit code."""
    argv = list(sys.argv if argv is None else ['pop_viewer', *argv])
    found = parse_arguments(remove_ros_args(argv)[1:])
    rclpy.init(args=argv)
    try:
        _run(found)
    except PopError as error:
        sys.stderr.write(f'pop viewer: {error}\n')
        return BAD_USAGE
    finally:
        rclpy.try_shutdown()  # type: ignore[attr-defined]
    return OK


def _run(found: argparse.Namespace) -> None:
    model = ModelFiles(found.body).load_body()
    config = MeshConfig(detail=found.detail, lifetime_s=found.lifetime_s)
    node = ViewerNode(model, found.node, config)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == '__main__':
    sys.exit(main())
