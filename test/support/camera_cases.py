"""A camera in a process of its own that sends the same scene in every form, good and bad.

Each case is one pair of images with a stamp of its own: case k has the stamp START_NS + k seconds.
"""

from __future__ import annotations

import array
import json
import os
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from sensor_msgs.msg import CameraInfo, CompressedImage, Image
from support.rvl import encode_rvl

from pop_core.geometry.camera import Camera
from pop_ros.image_messages import info_message
from pop_ros.to_messages import make_header

ROOT = Path(__file__).resolve().parents[2]
WIDTH, HEIGHT = 64, 48
FRAME_ID = 'camera'
START_NS = 1_700_000_000_000_000_000
CAMERA = Camera(WIDTH, HEIGHT, 60.0, 61.0, 31.0, 24.0)
COLUMNS, ROWS = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
RGB = np.stack([3 * COLUMNS, 5 * ROWS, 2 * COLUMNS + ROWS], axis=2).astype(np.uint8)
DEPTH_MM = np.where(ROWS < 4, 0, 1000 + 10 * COLUMNS + 7 * ROWS).astype(np.uint16)
DEPTH_M = np.where(DEPTH_MM > 0, DEPTH_MM / np.float32(1000), np.nan).astype(np.float32)
GRAY = RGB[..., :1]
Message = Any
Case = tuple[Message, Message, Message]


def stamp_of(case: int) -> int:
    """Return the stamp of the case of this number [ns]."""
    return START_NS + case * 1_000_000_000


def image(pixels: np.ndarray, encoding: str, *, padding: int = 0, **changes: Any) -> Image:
    """Return an image whose rows are followed by `padding` bytes of rubbish."""
    rows = np.ascontiguousarray(pixels).view(np.uint8).reshape(len(pixels), -1)
    rows = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    fields = {
        'height': pixels.shape[0], 'width': pixels.shape[1], 'encoding': encoding,
        'is_bigendian': int(pixels.dtype.byteorder == '>'), 'step': rows.shape[1],
        'data': array.array('B', rows.tobytes())}
    return Image(**{**fields, **changes})


def compressed(name: str, data: bytes) -> CompressedImage:
    return CompressedImage(format=name, data=array.array('B', data))


def encoded(suffix: str, pixels: np.ndarray) -> bytes:
    quality = [cv2.IMWRITE_JPEG_QUALITY, 98] if suffix == '.jpg' else []
    return bytes(cv2.imencode(suffix, pixels, quality)[1])


def quantised() -> bytes:
    """Return inverse depth as compressedDepth quantises 32FC1: depth = a / (raw - b)."""
    a, b = 20000.0, -2.0
    raw = np.where(DEPTH_MM > 0, np.rint(a / np.nan_to_num(DEPTH_M, nan=1.0) + b), 0)
    return struct.pack('<iff', 0, a, b) + encoded('.png', raw.astype(np.uint16))


def info(camera: Camera = CAMERA, **changes: Any) -> CameraInfo:
    message = info_message(camera, make_header(0, FRAME_ID))
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def color() -> Image:
    return image(RGB, 'rgb8')


def depth() -> Image:
    return image(DEPTH_MM, '16UC1')


def distorted(model: str, *d: float) -> Camera:
    return Camera(WIDTH, HEIGHT, 60.0, 61.0, 31.0, 24.0, model, np.array(d))


def binned() -> CameraInfo:
    """Return the info of a sensor of twice the size whose pixels are binned two by two."""
    full = Camera(2 * WIDTH, 2 * HEIGHT, 120.0, 122.0, 62.5, 48.5)
    return info(full, binning_x=2, binning_y=2)


def cropped() -> CameraInfo:
    """Return the info of a larger sensor of which only a part is sent."""
    message = info(Camera(200, 100, 60.0, 61.0, 41.0, 44.0))
    message.roi.x_offset, message.roi.y_offset = 10, 20
    message.roi.width, message.roi.height = WIDTH, HEIGHT
    return message


def bgra() -> np.ndarray:
    return np.dstack([RGB[..., ::-1], np.full((HEIGHT, WIDTH), 7, np.uint8)])


PLAIN: dict[str, Callable[[], Case]] = {
    'rgb8 and 16UC1': lambda: (color(), depth(), info()),
    'bgr8': lambda: (image(RGB[..., ::-1], 'bgr8'), depth(), info()),
    'rgba8': lambda: (image(bgra()[..., [2, 1, 0, 3]], 'rgba8'), depth(), info()),
    'bgra8': lambda: (image(bgra(), 'bgra8'), depth(), info()),
    '8UC3': lambda: (image(RGB[..., ::-1], '8UC3'), depth(), info()),
    'mono8': lambda: (image(GRAY, 'mono8'), depth(), info()),
    '8UC1': lambda: (image(GRAY, '8UC1'), depth(), info()),
    'mono16': lambda: (color(), image(DEPTH_MM, 'mono16'), info()),
    '32FC1': lambda: (color(), image(DEPTH_M, '32FC1'), info()),
    '32FC1 with infinity': lambda: (
        color(), image(np.nan_to_num(DEPTH_M, nan=np.inf), '32FC1'), info()),
    'big-endian 16UC1': lambda: (color(), image(DEPTH_MM.astype('>u2'), '16UC1'), info()),
    'big-endian 32FC1': lambda: (color(), image(DEPTH_M.astype('>f4'), '32FC1'), info()),
    'padded rows': lambda: (
        image(RGB, 'rgb8', padding=13), image(DEPTH_MM, '16UC1', padding=6), info()),
    'plumb_bob': lambda: (
        color(), depth(), info(distorted('plumb_bob', 0.1, -0.05, 0.001, 0.002, 0.01))),
    'rational_polynomial': lambda: (color(), depth(), info(distorted(
        'rational_polynomial', 0.1, -0.05, 0.001, 0.002, 0.01, 0.1, 0.02, 0.003))),
    'equidistant': lambda: (
        color(), depth(), info(distorted('equidistant', 0.05, 0.01, -0.002, 0.001))),
    'binning': lambda: (color(), depth(), binned()),
    'region of interest': lambda: (color(), depth(), cropped()),
}
COMPRESSED: dict[str, Callable[[], Case]] = {
    'jpeg and png': lambda: (
        compressed('rgb8; jpeg compressed bgr8', encoded('.jpg', RGB[..., ::-1])),
        compressed('16UC1; compressedDepth png', bytes(12) + encoded('.png', DEPTH_MM)), info()),
    'png and RVL': lambda: (
        compressed('bgr8; png compressed bgr8', encoded('.png', RGB[..., ::-1])),
        compressed('16UC1; compressedDepth rvl', bytes(12) + encode_rvl(DEPTH_MM)), info()),
    'quantised 32FC1': lambda: (
        compressed('jpeg', encoded('.jpg', RGB[..., ::-1])),
        compressed('32FC1; compressedDepth png', quantised()), info()),
    'old headers': lambda: (
        compressed('png', encoded('.png', RGB[..., ::-1])),
        compressed('16UC1; compressedDepth', bytes(12) + encoded('.png', DEPTH_MM)), info()),
}
# What must be refused, and a part of the sentence that names it. The log says sentences that only
# differ in numbers once in a while: encodings differ too.
BAD: dict[str, tuple[Callable[[], Case], str]] = {
    'empty colour': (lambda: (Image(encoding='rgb8'), depth(), info()), '0x0 rgb8'),
    'empty depth': (lambda: (color(), Image(encoding='16UC1'), info()), '0x0 16UC1'),
    'no encoding': (lambda: (image(RGB, ''), depth(), info()), "found ''"),
    'truncated data': (
        lambda: (color(), image(DEPTH_MM, 'mono16', data=array.array('B', bytes(100))), info()),
        'found step 128 and 100 bytes'),
    'step too small': (lambda: (image(RGB, 'bgr8', step=5), depth(), info()), 'found step 5'),
    'absurd size': (
        lambda: (image(RGB, '8UC3', width=4_000_000_000, height=4_000_000_000), depth(), info()),
        '4000000000x4000000000'),
    'bayer': (lambda: (image(GRAY, 'bayer_rggb8'), depth(), info()), 'debayer it first'),
    'depth as colour': (lambda: (depth(), depth(), info()), 'is a depth image remapped'),
    'colour as depth': (lambda: (color(), color(), info()), 'is a colour or disparity image'),
    'other size': (
        lambda: (color(), image(DEPTH_MM[::2, ::2], '16UC1'), info()), 'depth image 32x24'),
    'uncalibrated': (lambda: (color(), depth(), info(k=[0.0] * 9)), 'uncalibrated'),
    'unknown distortion': (
        lambda: (color(), depth(), info(distortion_model='mirror', d=[0.1] * 5)), 'mirror'),
    'depth elsewhere': (lambda: (color(), depth(), info()), 'no transform between them'),
    'infinite focal length': (
        lambda: (color(), depth(), info(k=[np.inf, 0.0, 31.0, 0.0, 61.0, 24.0, 0.0, 0.0, 1.0])),
        'camera_info'),
}
BAD_COMPRESSED: dict[str, tuple[Callable[[], Case], str]] = {
    'jpeg depth': (
        lambda: (compressed('png', encoded('.png', RGB)),
                 compressed('mono8; jpeg compressed', encoded('.jpg', GRAY)), info()),
        'JPEG destroys depth'),
    'empty jpeg': (
        lambda: (compressed('jpeg', b''), compressed(
            '16UC1; compressedDepth png', bytes(12) + encoded('.png', DEPTH_MM)), info()),
        'expected a JPEG or PNG'),
    'damaged RVL': (
        lambda: (compressed('png', encoded('.png', RGB)), compressed(
            '16UC1; compressedDepth rvl', (bytes(12) + encode_rvl(DEPTH_MM))[:200]), info()),
        'pixels of RVL'),
}


def is_compressed(name: str) -> bool:
    return name in COMPRESSED or name in BAD_COMPRESSED


def build(name: str, case: int) -> Case:
    """Return the messages of a case with its stamp."""
    made = {**PLAIN, **COMPRESSED}.get(name) or {**BAD, **BAD_COMPRESSED}[name][0]
    messages = made()
    for message in messages:
        message.header = make_header(stamp_of(case), FRAME_ID)
    if name == 'depth elsewhere':
        messages[1].header.frame_id = 'elsewhere'
    return messages


def start_cases(names: list[str], rate_hz: float) -> subprocess.Popen[bytes]:
    """Start the camera's process; it waits for a subscriber and ends by itself."""
    code = 'import sys; from support.camera_cases import main; main(*sys.argv[1:])'
    paths = os.pathsep.join([str(ROOT), str(ROOT / 'test')])
    return subprocess.Popen([sys.executable, '-c', code, json.dumps(names), str(rate_hz)],
                            env={**os.environ, 'PYTHONPATH': paths})


def main(names_json: str, rate_hz: str) -> None:
    """Publish the cases one after the other, all plain or all compressed."""
    import rclpy

    names = json.loads(names_json)
    suffixes = ('/compressed', '/compressedDepth') if is_compressed(names[0]) else ('', '')
    kind = CompressedImage if is_compressed(names[0]) else Image
    rclpy.init()
    node = rclpy.create_node('camera')
    topics = ((CameraInfo, 'color/camera_info'), (kind, f'color/image{suffixes[0]}'),
              (kind, f'depth/image{suffixes[1]}'))
    publishers = [node.create_publisher(kind, topic, 20) for kind, topic in topics]
    deadline = time.monotonic() + 60
    while min(p.get_subscription_count() for p in publishers) < 1:
        if time.monotonic() > deadline:
            raise SystemExit('camera: nobody subscribed')
        time.sleep(0.02)
    time.sleep(0.5)  # both sides must have matched
    for case, name in enumerate(names):
        color_message, depth_message, info_message = build(name, case)
        # The newest info counts: it must be there before the images it belongs to.
        publishers[0].publish(info_message)
        time.sleep(0.3 / float(rate_hz))
        publishers[1].publish(color_message)
        publishers[2].publish(depth_message)
        time.sleep(0.7 / float(rate_hz))
    time.sleep(1.0)  # the middleware must have sent everything
    node.destroy_node()
    rclpy.shutdown()
