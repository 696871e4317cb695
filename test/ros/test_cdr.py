"""The template writes what the message classes read."""

import time

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from pop_ros import cdr, cdr_array
from pop_ros.cdr import MarkerTemplate
from pop_ros.cdr_array import ArrayWriter
from pop_ros.to_messages import mesh_marker

POINTS = np.random.default_rng(5).normal(size=(300, 3))


@pytest.mark.parametrize('frame_id', ['', 'a', 'ab', 'abc', 'abcd', 'camera_color_optical_frame'])
def test_template_and_objects_give_equal_messages_whatever_the_alignment(frame_id: str) -> None:
    template = MarkerTemplate(mesh_marker(3, frame_id, 1.5))
    assert template.is_fast
    stamp_ns = 1_700_000_000_123_456_789
    fast = deserialize_message(template.message(stamp_ns, POINTS), Marker)
    template.is_fast = False
    slow = deserialize_message(serialize_message(template.message(stamp_ns, POINTS)), Marker)
    assert fast == slow
    assert fast.header.frame_id == frame_id
    assert (fast.header.stamp.sec, fast.header.stamp.nanosec) == divmod(stamp_ns, 10**9)
    assert [fast.points[7].x, fast.points[7].y, fast.points[7].z] == POINTS[7].tolist()


def test_a_message_of_the_template_survives_another_round_trip() -> None:
    template = MarkerTemplate(mesh_marker(0, 'camera', 0.0))
    once = deserialize_message(template.message(5, POINTS), Marker)
    assert deserialize_message(serialize_message(once), Marker) == once


def test_a_template_that_does_not_fit_falls_back_to_objects(
    monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cdr, 'split_at_points', lambda _marker: None)
    template = MarkerTemplate(mesh_marker(0, 'camera', 0.0))
    message = template.message(7, POINTS)
    assert isinstance(message, Marker)
    assert len(message.points) == len(POINTS)


def test_bytes_that_read_as_something_else_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = cdr.split_at_points

    def shifted(marker: Marker) -> tuple[bytes, bytes, bytes]:
        parts = whole(marker)
        assert parts is not None
        head, padding, tail = parts
        return head, bytes(4 - len(padding)), tail

    monkeypatch.setattr(cdr, 'split_at_points', shifted)
    assert not MarkerTemplate(mesh_marker(0, 'camera', 0.0)).is_fast


def test_time_of_the_template_is_a_small_part_of_that_of_objects() -> None:
    points = np.zeros((41_328, 3))
    template = MarkerTemplate(mesh_marker(0, 'camera', 0.0))

    def seconds() -> float:
        start = time.perf_counter()
        template.message(1, points)
        return time.perf_counter() - start

    fast = min(seconds() for _ in range(5))
    template.is_fast = False
    assert fast < 0.2 * seconds()  # 40 to 100 times faster where measured


@pytest.mark.parametrize('text', ['', '7', 'seven', 'twelve bytes'])
def test_an_array_of_meshes_and_small_markers_reads_as_its_objects(text: str) -> None:
    def parts() -> tuple[list[Marker], list[tuple[Marker, np.ndarray]]]:
        small = [Marker(ns=text, text=text), Marker(ns='last', id=4)]
        return small, [(mesh_marker(k, text, 0.0), POINTS[: 6 + 3 * k]) for k in range(3)]

    assert ArrayWriter().is_fast
    fast = cdr_array.as_bytes(*parts())
    assert fast is not None
    slow = serialize_message(cdr_array.as_object(*parts()))  # colours are float32 there too
    assert deserialize_message(fast, MarkerArray) == deserialize_message(slow, MarkerArray)


def test_an_array_that_cannot_be_bytes_is_an_object(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cdr_array, 'ONE', b'\0\0\0\2')
    writer = ArrayWriter()
    assert not writer.is_fast
    message = writer.message([Marker()], [(mesh_marker(0, 'camera', 0.0), POINTS)])
    assert isinstance(message, MarkerArray)
    assert [len(m.points) for m in message.markers] == [300, 0]
