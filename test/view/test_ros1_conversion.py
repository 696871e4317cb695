"""Messages keep their meaning on the way between ROS 1 and ROS 2."""

import struct
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from rosbags.rosbag1 import Writer
from visualization_msgs.msg import Marker, MarkerArray

from pop_ros.bag_reader import BagReader
from pop_ros.cdr import MarkerTemplate
from pop_ros.marker_points import CDR, ROS1, take_points
from pop_ros.plain_cdr import with_zero_padding
from pop_ros.recorded_bodies import MESH
from pop_ros.ros1_conversion import (
    MARKER,
    ROS1_STORE,
    STORE,
    cdr_to_ros1,
    read_marker,
    ros1_to_cdr,
)
from pop_ros.to_messages import mesh_marker

STAMP_NS = 1_700_000_000_250_000_000
ARRAY = 'visualization_msgs/msg/MarkerArray'


def mesh(count: int, frame_id: str = 'camera', name: str = 'pop_mesh') -> bytes:
    """Return a stored mesh of some points."""
    marker = mesh_marker(5, frame_id, 1.5)
    marker.ns = name
    points = np.random.default_rng(count).normal(size=(count, 3))
    made = bytes(MarkerTemplate(marker).message(STAMP_NS, points))
    return with_zero_padding(made, MARKER)


# Alignment depends on the lengths of the strings before the points.
@pytest.mark.parametrize('frame_id', ['', 'c', 'cam', 'camera', 'camera_o', 'camera_op'])
@pytest.mark.parametrize('name', ['p', 'pop_mesh'])
def test_a_mesh_comes_back_from_ros1_as_it_was(frame_id: str, name: str) -> None:
    for count in (0, 1, 3, 300):
        original = mesh(count, frame_id, name)
        assert ros1_to_cdr(cdr_to_ros1(original, MARKER), MARKER) == original


@pytest.mark.parametrize('frame_id', ['c', 'cam', 'camera'])
def test_points_taken_as_an_array_are_those_of_the_message(frame_id: str) -> None:
    data = mesh(60, frame_id)
    slow = STORE.deserialize_cdr(data, MARKER)
    marker, points = read_marker(data)
    assert points.tolist() == [[p.x, p.y, p.z] for p in slow.points]
    assert (marker.id, marker.ns, marker.lifetime) == (slow.id, slow.ns, slow.lifetime)
    in_ros1 = cdr_to_ros1(data, MARKER)
    assert ROS1_STORE.deserialize_ros1(in_ros1, MARKER).points[59].z == points[59, 2]
    taken = take_points(in_ros1, ROS1)
    assert taken is not None
    assert np.array_equal(taken[1], points)


def test_a_marker_that_promises_more_points_than_it_has_is_not_believed() -> None:
    data = bytearray(mesh(3))
    at = data.index(struct.pack('<I', 3), 100)
    data[at: at + 4] = struct.pack('<I', 2**31)
    assert take_points(bytes(data), CDR) is None
    for length in range(0, len(data), 7):
        take_points(bytes(data[:length]), CDR)


def test_arrays_of_markers_come_back_from_ros1_as_they_were() -> None:
    array = MarkerArray(markers=[Marker(ns='a', id=1, text='one'), mesh_marker(2, 'camera', 0.0)])
    original = with_zero_padding(bytes(serialize_message(array)), ARRAY)
    assert ros1_to_cdr(cdr_to_ros1(original, ARRAY), ARRAY) == original


def test_meshes_of_a_ros1_bag_are_read(tmp_path: Path) -> None:
    original = mesh(30)
    with Writer(tmp_path / 'a.bag') as bag:
        connection = bag.add_connection(MESH, MARKER, typestore=ROS1_STORE)
        bag.write(connection, STAMP_NS, cdr_to_ros1(original, MARKER))
    with BagReader(tmp_path / 'a.bag') as reader:
        message, = reader.messages([MESH])
        assert not reader.damage
    assert message.data == original
