"""Write RGB-D frames as the bag a camera driver would have recorded."""

from __future__ import annotations

import array
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_topics import IMAGE, INFO, RgbdTopics
from pop_ros.bag_writer import BagWriter
from pop_ros.to_messages import make_header

CAMERA_TOPICS = RgbdTopics(
    color='/camera/color/image_raw',
    depth='/camera/aligned_depth_to_color/image_raw',
    info='/camera/color/camera_info')
CAMERA_FRAME = 'camera_color_optical_frame'


def write_frame_bag(
    folder: Path, frames: Iterable[RgbdFrame], *, frame_id: str = CAMERA_FRAME
) -> RgbdTopics:
    """Write frames as a new rosbag2 with rgb8 colour and 16UC1 depth; return its topics.

    Raises:
        BagError: If the folder exists.
    """
    with BagWriter(folder) as bag:
        for frame in frames:
            header = make_header(frame.stamp_ns, frame_id)
            messages: tuple[tuple[str, str, Any], ...] = (
                (CAMERA_TOPICS.info, INFO, info_message(frame.camera, header)),
                (CAMERA_TOPICS.color, IMAGE, color_message(frame.rgb, header)),
                (CAMERA_TOPICS.depth, IMAGE, depth_message(frame.depth_m, header)),
            )
            for topic, kind, message in messages:
                bag.write(topic, kind, frame.stamp_ns, bytes(serialize_message(message)))
    return CAMERA_TOPICS


def color_message(rgb: np.ndarray, header: Header) -> Image:
    """Return an rgb8 image."""
    return _image(rgb, 'rgb8', header)


def depth_message(depth_m: np.ndarray, header: Header) -> Image:
    """Return a 16UC1 image in millimetres, 0 where nothing was measured (REP 118)."""
    millimetres = np.nan_to_num(np.rint(depth_m * 1000), nan=0.0)
    return _image(np.clip(millimetres, 0, 65535).astype('<u2'), '16UC1', header)


def info_message(camera: Camera, header: Header) -> CameraInfo:
    """Return the CameraInfo of a camera whose images are not rectified."""
    K = camera.K
    d = camera.d if camera.d.size else np.zeros(5)
    return CameraInfo(
        header=header, width=camera.width, height=camera.height,
        distortion_model=camera.distortion_model or 'plumb_bob', d=d.tolist(),
        k=K.ravel().tolist(), r=np.eye(3).ravel().tolist(),
        p=np.column_stack([K, np.zeros(3)]).ravel().tolist())


def _image(pixels: np.ndarray, encoding: str, header: Header) -> Image:
    data = array.array('B')
    data.frombytes(np.ascontiguousarray(pixels).tobytes())
    height, width = pixels.shape[:2]
    return Image(
        header=header, height=height, width=width, encoding=encoding, is_bigendian=0,
        step=len(data) // height, data=data)
