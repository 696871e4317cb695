"""Messages of the generated classes as dictionaries, lists and numbers."""

from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message


def plain(value: Any) -> Any:
    """Return what JSON can hold of a message or of a part of one."""
    if hasattr(value, 'get_fields_and_field_types'):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, str | bytes | int | float | bool):
        return value
    return [plain(item) for item in value]


def received(message: Any) -> Any:
    """Return a message as it arrives, in plain words."""
    return plain(deserialize_message(serialize_message(message), type(message)))
