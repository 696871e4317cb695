"""Write RGB-D frames as the bag a camera driver would have recorded."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from jaxtyping import Float
from rclpy.serialization import serialize_message

from pop_core.geometry.rotation import to_quat_xyzw
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_topics import IMAGE, INFO, RgbdTopics
from pop_ros.bag_writer import BagWriter
from pop_ros.image_messages import color_message, depth_message, info_message
from pop_ros.ros1_conversion import STORE
from pop_ros.to_messages import make_header

CAMERA_TOPICS = RgbdTopics(
    color='/camera/color/image_raw',
    depth='/camera/aligned_depth_to_color/image_raw',
    info='/camera/color/camera_info')
CAMERA_FRAME = 'camera_color_optical_frame'
MAP_FRAME = 'map'  # REP 105: a fixed frame, z up
TF = 'tf2_msgs/msg/TFMessage'


class FrameBag:
    """A new rosbag2 that grows by frames: rgb8 colour, 16UC1 depth, CameraInfo."""

    def __init__(self, folder: Path, frame_id: str = CAMERA_FRAME) -> None:
        """Name the bag and the frame of the colour camera.

        Raises:
            BagError: If the folder exists.
        """
        self._bag, self._frame_id = BagWriter(folder), frame_id

    def __enter__(self) -> FrameBag:
        """Create the bag."""
        self._bag.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Finish the bag."""
        self._bag.__exit__(kind, error, traceback)

    def add(
        self, frame: RgbdFrame, T_map_camera: Float[np.ndarray, '4 4'] | None = None
    ) -> None:
        """Write a frame, and on /tf where its camera is, if that is known."""
        header = make_header(frame.stamp_ns, self._frame_id)
        messages: tuple[tuple[str, str, Any], ...] = (
            (CAMERA_TOPICS.info, INFO, info_message(frame.camera, header)),
            (CAMERA_TOPICS.color, IMAGE, color_message(frame.rgb, header)),
            (CAMERA_TOPICS.depth, IMAGE, depth_message(frame.depth_m, header)),
        )
        if T_map_camera is not None:
            # First, so that whoever replays the bag knows where an image was taken.
            self._bag.write(
                '/tf', TF, frame.stamp_ns, _tf_cdr(frame.stamp_ns, self._frame_id, T_map_camera))
        for topic, kind, message in messages:
            self._bag.write(topic, kind, frame.stamp_ns, bytes(serialize_message(message)))


def write_frame_bag(
    folder: Path, frames: Iterable[RgbdFrame], *, frame_id: str = CAMERA_FRAME
) -> RgbdTopics:
    """Write frames as a new rosbag2 with rgb8 colour and 16UC1 depth; return its topics.

    Raises:
        BagError: If the folder exists.
    """
    with FrameBag(folder, frame_id) as bag:
        for frame in frames:
            bag.add(frame)
    return CAMERA_TOPICS


def _tf_cdr(
    stamp_ns: int, frame_id: str, T_map_camera: Float[np.ndarray, '4 4']
) -> bytes:
    """Return a tf2_msgs/TFMessage; rosbags has its type where ROS 2 from pip lacks it."""
    types: Any = STORE.types
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    header = types['std_msgs/msg/Header'](
        stamp=types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds),
        frame_id=MAP_FRAME)
    x, y, z = T_map_camera[:3, 3].tolist()
    quat = to_quat_xyzw(T_map_camera[:3, :3]).tolist()
    transform = types['geometry_msgs/msg/Transform'](
        translation=types['geometry_msgs/msg/Vector3'](x=x, y=y, z=z),
        rotation=types['geometry_msgs/msg/Quaternion'](*quat))
    stamped = types['geometry_msgs/msg/TransformStamped'](
        header=header, child_frame_id=frame_id, transform=transform)
    return bytes(STORE.serialize_cdr(types[TF](transforms=[stamped]), TF))
