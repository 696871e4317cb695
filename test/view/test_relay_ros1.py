"""`pop relay-ros1`: what is published on ROS 2 arrives on ROS 1 as it was."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import Point, Pose, PoseArray
from rosbags.highlevel import AnyReader
from sensor_msgs.msg import PointCloud2
from support.node import ROOT
from visualization_msgs.msg import Marker

from pop_ros.cdr import MarkerTemplate
from pop_ros.qos import output_qos
from pop_ros.to_messages import CLOUD_FIELDS, CLOUD_TYPE, make_header, mesh_marker
from scripts.ros1_screen import PACKAGES, Ros1Screen, missing_programs, ros1_screen

MISSING = missing_programs()
STAMP_NS = 1_700_000_000_250_000_000
TOPICS = ('/pop/mesh', '/pop/joints', '/pop/cloud')

needs_ros1 = pytest.mark.skipif(
    bool(MISSING), reason=f'no {", ".join(MISSING)} here (apt-get install {PACKAGES})')


def start_relay(environment: dict[str, str], *arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, '-m', 'pop_ros.cli', 'relay-ros1', *map(str, arguments)],
        env={**os.environ, **environment, 'PYTHONPATH': str(ROOT)}, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)


@pytest.fixture
def ros1(tmp_path: Path) -> Iterator[Ros1Screen]:
    with ros1_screen(tmp_path, (320, 240)) as screen:
        yield screen


def messages(points: np.ndarray, cloud: np.ndarray) -> dict[str, tuple[type, object]]:
    marker = MarkerTemplate(mesh_marker(3, 'camera', 0.0)).message(STAMP_NS, points)
    header = make_header(STAMP_NS, 'camera')
    poses = [Pose(position=Point(x=p[0], y=p[1], z=p[2])) for p in points[:24].tolist()]
    return {
        '/pop/mesh': (Marker, bytes(marker)),
        '/pop/joints': (PoseArray, PoseArray(header=header, poses=poses)),
        '/pop/cloud': (PointCloud2, PointCloud2(
            header=header, height=1, width=len(cloud), fields=CLOUD_FIELDS,
            point_step=cloud.itemsize, row_step=cloud.nbytes, data=cloud.tobytes())),
    }


def recorded(bag: Path) -> dict[str, object]:
    with AnyReader([bag]) as reader:
        return {c.topic: reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()}


@needs_ros1
def test_mesh_joints_and_points_arrive_on_ros1_as_they_were(
    ros1: Ros1Screen, tmp_path: Path
) -> None:
    rng = np.random.default_rng(0)
    points, cloud = rng.normal(size=(300, 3)), np.zeros(50, CLOUD_TYPE)
    cloud['x'], cloud['rgb'] = rng.normal(size=50), rng.integers(0, 2**24, 50)
    bag = tmp_path / 'ros1.bag'
    ros1.start('rosbag', 'record', '--quiet', '--limit=1', '-O', bag, *TOPICS)
    relay = start_relay({'ROS_MASTER_URI': ros1.environment['ROS_MASTER_URI'],
                         'ROS_HOSTNAME': 'localhost'})
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('publisher', context=context)
    try:
        outgoing = messages(points, cloud)
        publishers = {topic: node.create_publisher(kind, topic, output_qos())
                      for topic, (kind, _) in outgoing.items()}

        def has_arrived() -> bool:
            assert relay.poll() is None, relay.communicate()
            for topic, (_, message) in outgoing.items():
                publishers[topic].publish(message)
            return bag.is_file()  # rosbag names it so when it is complete

        ros1.wait_for(has_arrived, 'message on ROS 1')
        relay.send_signal(signal.SIGINT)
        said, complained = relay.communicate(timeout=20)
    finally:
        relay.kill()
        node.destroy_node()
        rclpy.shutdown(context=context)
    assert relay.returncode == 0, complained
    assert 'of /pop/mesh' in said
    found = recorded(bag)
    assert {m.header.frame_id for m in found.values()} == {'camera'}
    assert {m.header.stamp.nanosec for m in found.values()} == {250_000_000}
    mesh = found['/pop/mesh']
    assert (mesh.id, mesh.type, mesh.color.a) == (3, Marker.TRIANGLE_LIST, 1.0)
    assert [[p.x, p.y, p.z] for p in mesh.points] == points.tolist()
    assert [p.position.y for p in found['/pop/joints'].poses] == points[:24, 1].tolist()
    assert np.array_equal(np.frombuffer(found['/pop/cloud'].data, CLOUD_TYPE), cloud)


@needs_ros1
def test_the_ros1_side_ends_with_the_relay(ros1: Ros1Screen) -> None:
    relay = start_relay({'ROS_MASTER_URI': ros1.environment['ROS_MASTER_URI'],
                         'ROS_HOSTNAME': 'localhost'})

    def is_up() -> bool:
        assert relay.poll() is None, relay.communicate()
        return '/pop_relay' in ros1.ask('rosnode', 'list')

    ros1.wait_for(is_up, 'ROS 1 side')
    time.sleep(0.5)
    relay.kill()  # without any chance to clean up
    relay.wait(10)
    ros1.wait_for(lambda: '/pop_relay' not in ros1.ask('rosnode', 'list'), 'end of ROS 1 side')


@pytest.mark.parametrize(('python', 'told'), [
    (sys.executable, 'expected a Python with rospy'), ('/nowhere/python3', '/nowhere/python3')])
def test_a_python_without_rospy_is_one_sentence(python: str, told: str) -> None:
    relay = start_relay({}, '--python', python)
    _, complained = relay.communicate(timeout=60)
    assert relay.returncode == 2
    assert told in complained
    assert 'Traceback' not in complained
