"""Images and camera infos as rosbags messages, built from arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from pop_core.geometry.camera import Camera

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = STORE.types
IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'
FRAME_ID = 'camera_color_optical_frame'


def header(stamp_ns: int, frame_id: str = FRAME_ID) -> Any:
    time = TYPES['builtin_interfaces/msg/Time'](*divmod(stamp_ns, 1_000_000_000))
    return TYPES['std_msgs/msg/Header'](time, frame_id)


def image(
    array: np.ndarray, encoding: str, stamp_ns: int = 0, *, padding: int = 0,
    frame_id: str = FRAME_ID,
) -> Any:
    """Return an Image of an array whose rows are followed by `padding` bytes of rubbish."""
    is_bigendian = array.dtype.byteorder == '>'
    rows = np.ascontiguousarray(array).view(np.uint8).reshape(len(array), -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    return TYPES[IMAGE](
        header(stamp_ns, frame_id), array.shape[0], array.shape[1], encoding, int(is_bigendian),
        rows.shape[1], np.ascontiguousarray(rows).ravel())


def depth_image(depth_m: np.ndarray, encoding: str, stamp_ns: int = 0) -> Any:
    """Return a depth image [m] in the units that its encoding asks for."""
    if encoding == '32FC1':
        return image(depth_m.astype('<f4'), encoding, stamp_ns)
    millimetres = np.nan_to_num(np.rint(depth_m * 1000), nan=0.0).astype('<u2')
    return image(millimetres, encoding, stamp_ns)


def camera_info(camera: Camera, stamp_ns: int = 0, **changes: Any) -> Any:
    K = camera.K
    roi = TYPES['sensor_msgs/msg/RegionOfInterest'](0, 0, 0, 0, False)
    fields = {
        'header': header(stamp_ns), 'height': camera.height, 'width': camera.width,
        'distortion_model': camera.distortion_model or 'plumb_bob',
        'd': camera.d.astype(np.float64) if camera.d.size else np.zeros(5), 'k': K.ravel(),
        'r': np.eye(3).ravel(), 'p': np.column_stack([K, np.zeros(3)]).ravel(),
        'binning_x': 0, 'binning_y': 0, 'roi': roi,
    }
    return TYPES[INFO](**{**fields, **changes})
