"""The verdict of a long run, and the camera that feeds it."""

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo

from benchmarks.node_camera import with_stamp
from benchmarks.node_live import Listener, verdict
from pop_ros.from_messages import stamp_ns
from pop_ros.to_messages import make_header

STAMP_NS = 1_700_000_000_123_456_789


def rows(memory_mb: list[float], p95_ms: list[float]) -> list[dict[str, object]]:
    return [{'memory [MB]': m, 'p95 [ms]': p}
            for m, p in zip(memory_mb, p95_ms, strict=True)]


@pytest.mark.parametrize(('memory_mb', 'p95_ms', 'code', 'stop_s', 'told'), [
    ([500, 505, 510], [100, 120, 110], 0, 1.0, 'good'),
    ([500, 510, 530], [100, 100, 100], 0, 1.0, 'bad: memory'),
    ([1001, 1001, 1001], [100, 100, 100], 0, 1.0, 'bad: memory'),
    ([500, 500, 500], [100, 120, 140], 0, 1.0, 'bad: latency'),
    ([500, 500, 500], [100, 100, 100], 1, 1.0, 'bad: end'),
    ([500, 500, 500], [100, 100, 100], 0, 20.0, 'bad: end'),
    ([500, 500, 530], [100, 100, 200], -9, 30.0, 'bad: memory, latency, end'),
])
def test_growth_and_a_bad_end_are_named(
    memory_mb: list[float], p95_ms: list[float], code: int, stop_s: float, told: str
) -> None:
    row, good = verdict(rows(memory_mb, p95_ms), code, stop_s)
    assert row['verdict'] == told
    assert good == (told == 'good')


def test_a_serialised_message_takes_another_stamp_and_stays_the_same_otherwise() -> None:
    info = CameraInfo(header=make_header(5, 'camera'), width=640, distortion_model='plumb_bob')
    data = with_stamp(bytes(serialize_message(info)), STAMP_NS)
    found = deserialize_message(data, CameraInfo)
    assert stamp_ns(found.header) == STAMP_NS
    info.header = found.header
    assert found == info


def test_a_listener_counts_images_once_and_forgets_what_was_taken() -> None:
    listener = Listener({STAMP_NS: 0.0})
    data = bytes(serialize_message(CameraInfo(header=make_header(STAMP_NS, 'camera'))))
    for _ in range(3):  # three people of one image
        listener.on_mesh(data)
    listener.on_mesh(with_stamp(data, STAMP_NS + 1))
    latency_s, frames = listener.take()
    assert (len(latency_s), frames) == (3, 1)
    assert min(latency_s) > 0
    assert listener.take() == ([], 0)
