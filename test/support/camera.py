"""A camera in a process of its own: publishes small RGB-D frames as a JSON plan says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT = 64, 48
STEP_NS = 33_000_000
START_NS = 1_700_000_000_000_000_000


@dataclass(frozen=True)
class CameraPlan:
    """What the camera publishes.

    Args:
        frames: Frames per play.
        plays: How often the recording is played; stamps start anew each time.
        rate_hz: Frames per second of wall time.
        reliable: Reliability of the images.
        info: 'every' frame, 'latched' once before, 'late' once after the images.
        depth_lag_ns: Depth stamp minus colour stamp [ns].
        depth_encoding: Encoding of depth.
        break_frame: Index of a frame whose colour image is malformed, -1 for none.
        depth_frame: Frame of depth; another than 'camera' comes with depth/camera_info.
        compressed: Whether only compressed images are published.
        listeners: Subscribers on each topic to wait for before the first frame.
    """

    frames: int = 10
    plays: int = 1
    rate_hz: float = 50.0
    reliable: bool = True
    info: str = 'every'
    depth_lag_ns: int = 0
    depth_encoding: str = '16UC1'
    break_frame: int = -1
    depth_frame: str = 'camera'
    compressed: bool = False
    listeners: int = 1


def start_camera(plan: CameraPlan) -> subprocess.Popen[bytes]:
    """Start the camera's process; it ends by itself."""
    code = 'import sys; from support.camera import main; main(sys.argv[1])'
    paths = {'PYTHONPATH': f'{ROOT}:{ROOT / "test"}'}
    return subprocess.Popen(
        [sys.executable, '-c', code, json.dumps(asdict(plan))], env={**os.environ, **paths})


def main(plan_json: str) -> None:
    """Publish what the plan says."""
    import rclpy
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image

    plan = CameraPlan(**json.loads(plan_json))
    reliability = ReliabilityPolicy.RELIABLE if plan.reliable else ReliabilityPolicy.BEST_EFFORT
    rclpy.init()
    node = rclpy.create_node('camera')
    images = QoSProfile(depth=20, reliability=reliability)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    if plan.compressed:
        color = node.create_publisher(CompressedImage, 'color/image/compressed', images)
        depth = node.create_publisher(CompressedImage, 'depth/image/compressedDepth', images)
    else:
        color = node.create_publisher(Image, 'color/image', images)
        depth = node.create_publisher(Image, 'depth/image', images)
    info = node.create_publisher(
        CameraInfo, 'color/camera_info', latched if plan.info == 'latched' else 10)
    if plan.depth_frame != 'camera':
        depth_info = node.create_publisher(CameraInfo, 'depth/camera_info', latched)
        depth_info.publish(camera_info(START_NS))
    if plan.info == 'latched':
        info.publish(camera_info(START_NS))
    deadline = time.monotonic() + 30
    while min(p.get_subscription_count() for p in (color, depth, info)) < plan.listeners:
        if time.monotonic() > deadline:
            raise SystemExit('camera: nobody subscribed')
        time.sleep(0.02)
    time.sleep(0.4)  # both sides must have matched, and what is latched have arrived
    for _ in range(plan.plays):
        for k in range(plan.frames):
            publish_frame(plan, k, color, depth, info)
            time.sleep(1 / plan.rate_hz)
    if plan.info == 'late':
        time.sleep(0.3)
        info.publish(camera_info(START_NS))
    time.sleep(0.6)  # the middleware must have sent everything
    node.destroy_node()
    rclpy.shutdown()


def publish_frame(plan: CameraPlan, k: int, color: Any, depth: Any, info: Any) -> None:
    """Publish frame `k` on the three publishers."""
    stamp = START_NS + k * STEP_NS
    if plan.info == 'every':
        info.publish(camera_info(stamp))
    message = color_image(stamp, k)
    if k == plan.break_frame:
        message.step = 1
    far = depth_image(stamp + plan.depth_lag_ns, plan.depth_encoding)
    far.header.frame_id = plan.depth_frame
    color.publish(as_png(message, 'rgb8; png compressed bgr8', b'')
                  if plan.compressed else message)
    depth.publish(as_png(far, '16UC1; compressedDepth png', bytes(12))
                  if plan.compressed else far)


def header(stamp_ns: int) -> Any:
    from pop_ros.to_messages import make_header
    return make_header(stamp_ns, 'camera')


def color_image(stamp_ns: int, value: int) -> Any:
    import numpy as np

    from pop_ros.image_messages import color_message
    return color_message(np.full((HEIGHT, WIDTH, 3), value % 256, np.uint8), header(stamp_ns))


def depth_image(stamp_ns: int, encoding: str) -> Any:
    import array

    import numpy as np
    from sensor_msgs.msg import Image
    values = np.full((HEIGHT, WIDTH), 2000 if encoding == '16UC1' else 2.0,
                     '<u2' if encoding == '16UC1' else '<f4')
    return Image(
        header=header(stamp_ns), height=HEIGHT, width=WIDTH, encoding=encoding,
        step=values.strides[0], data=array.array('B', values.tobytes()))


def as_png(message: Any, name: str, start: bytes) -> Any:
    """Return an image as PNG; its grey or 16-bit values mean the same in any channel order."""
    import array

    import cv2
    import numpy as np
    from sensor_msgs.msg import CompressedImage
    kind, channels = (np.uint8, 3) if message.encoding == 'rgb8' else (np.uint16, 1)
    pixels = np.frombuffer(message.data, kind).reshape(HEIGHT, WIDTH, channels)
    data = start + cv2.imencode('.png', pixels)[1].tobytes()
    return CompressedImage(header=message.header, format=name, data=array.array('B', data))


def camera_info(stamp_ns: int) -> Any:
    from pop_core.geometry.camera import Camera
    from pop_ros.image_messages import info_message
    camera = Camera(WIDTH, HEIGHT, 60.0, 60.0, 31.5, 23.5)
    return info_message(camera, header(stamp_ns))
