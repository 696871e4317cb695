"""Messages as bags of ROS 1 and of ROS 2 store them, and the way from one to the other."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from rclpy.serialization import serialize_message
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from visualization_msgs.msg import Marker

from pop_ros.marker_points import CDR, ROS1, put_points, take_points
from pop_ros.pop_messages import definition_files

STORE = get_typestore(Stores.ROS2_JAZZY)
ROS1_STORE = get_typestore(Stores.ROS1_NOETIC)
# Debian's ROS 1 has them in a package of its own; rosbags counts them to ROS 2 only.
ROS1_STORE.register(get_types_from_msg(
    'geometry_msgs/TransformStamped[] transforms', 'tf2_msgs/msg/TFMessage'))
for file in definition_files():
    definition = get_types_from_msg(file.read_text(encoding='utf-8'), f'pop_msgs/msg/{file.stem}')
    STORE.register(definition)
    ROS1_STORE.register(definition)
MARKER = 'visualization_msgs/msg/Marker'
# Types whose layout ROS 2 has extended; they are rewritten field by field.
EXTENDED_IN_ROS2 = {MARKER, 'visualization_msgs/msg/MarkerArray'}
EMPTY_MARKER: Any = STORE.deserialize_cdr(bytes(serialize_message(Marker())), MARKER)


def cdr_to_ros1(data: bytes, kind: str) -> bytes:
    """Return a message of ROS 2 as ROS 1 serialises it; fields ROS 1 does not have are dropped."""
    if kind not in EXTENDED_IN_ROS2:
        return bytes(STORE.cdr_to_ros1(data, kind))
    taken = take_points(data, CDR) if kind == MARKER else None
    small = data if taken is None else taken[0]
    # Only the sequence number of headers is missing in ROS 2; in bags nobody needs it.
    message = _rewritten(STORE.deserialize_cdr(small, kind), ROS1_STORE.types, 0)
    found = bytes(ROS1_STORE.serialize_ros1(message, kind))
    return found if taken is None else put_points(found, taken[1], ROS1)


def ros1_to_cdr(data: bytes, kind: str) -> bytes:
    """Return a message of ROS 1 as ROS 2 CDR; fields ROS 1 does not have stay empty."""
    if kind not in EXTENDED_IN_ROS2:
        return bytes(STORE.ros1_to_cdr(data, kind))
    taken = take_points(data, ROS1) if kind == MARKER else None
    small = data if taken is None else taken[0]
    message = _rewritten(ROS1_STORE.deserialize_ros1(small, kind), STORE.types, EMPTY_MARKER)
    found = bytes(STORE.serialize_cdr(message, kind))
    return found if taken is None else put_points(found, taken[1], CDR)


def read_marker(data: bytes) -> tuple[Any, Float[np.ndarray, 'n 3']]:
    """Return a Marker of ROS 2 CDR without most of its points, and all points [m] as an array."""
    taken = take_points(data, CDR)
    if taken is not None:
        return STORE.deserialize_cdr(taken[0], MARKER), taken[1]
    marker: Any = STORE.deserialize_cdr(data, MARKER)
    points = [(point.x, point.y, point.z) for point in marker.points]
    return marker, np.array(points, dtype=np.float64).reshape(-1, 3)


def _rewritten(value: Any, types: Any, missing: Any) -> Any:
    """Return a rosbags message as the type of the same name in another store.

    Args:
        value: Message, list of messages, or plain value.
        types: Types of the other store by name.
        missing: Where a field that `value` lacks comes from: a message, or the value itself.
    """
    if isinstance(value, list):
        return [_rewritten(item, types, missing) for item in value]
    if not is_dataclass(value):
        return value
    kind: Any = types[value.__msgtype__]  # type: ignore[union-attr]
    names = [field.name for field in fields(kind) if field.name != '__msgtype__']
    return kind(**{
        name: _rewritten(getattr(value, name), types, missing) if hasattr(value, name)
        else getattr(missing, name, missing) for name in names})
