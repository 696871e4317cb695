"""Write RGB-D frames as the bag a camera driver would have recorded."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rclpy.serialization import serialize_message

from pop_core.rgbd import RgbdFrame
from pop_ros.bag_topics import IMAGE, INFO, RgbdTopics
from pop_ros.bag_writer import BagWriter
from pop_ros.image_messages import color_message, depth_message, info_message
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
