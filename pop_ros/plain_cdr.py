"""Give the same message the same bytes: rclpy leaves its padding as it found the memory."""

from __future__ import annotations

from pop_ros.ros1_conversion import STORE


def with_zero_padding(data: bytes, kind: str) -> bytes:
    """Return a message of ROS 2 whose padding is zero.

    Args:
        data: The message as rclpy serialised it.
        kind: Type in the form 'sensor_msgs/msg/PointCloud2'; one that rosbags knows.
    """
    return bytes(STORE.serialize_cdr(STORE.deserialize_cdr(data, kind), kind))
