"""Compressed images decode to what was encoded, by encoders written here."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.bags import CAMERA, write_bag
from support.messages import INFO, TYPES, camera_info, header
from support.rvl import encode_rvl

from pop_core.geometry.camera import Camera
from pop_ros.bag_reader import BagReader
from pop_ros.bag_topics import find_topics
from pop_ros.from_messages import decode_color, decode_depth, frame_from_messages
from pop_ros.message_error import BadMessageError

KIND = 'sensor_msgs/msg/CompressedImage'
CAM = Camera(40, 30, 40.0, 40.0, 19.5, 14.5)


def compressed(name: str, data: bytes, stamp_ns: int = 0) -> object:
    return TYPES[KIND](header(stamp_ns), name, np.frombuffer(data, np.uint8))


def png(image: np.ndarray) -> bytes:
    return cv2.imencode('.png', image)[1].tobytes()


def depth_header(a: float = 0.0, b: float = 0.0) -> bytes:
    return struct.pack('<iff', 0, a, b)


@pytest.fixture
def depth_mm() -> np.ndarray:
    rng = np.random.default_rng(3)
    depth = np.full((30, 40), 1500, np.uint16) + rng.integers(0, 30, (30, 40)).astype(np.uint16)
    depth[:, 20:] += 2000
    depth[5:9, 3:33] = 0
    depth[0, 0], depth[-1, -1] = 65535, 0
    return depth


@pytest.mark.parametrize('name', [
    'rgb8; png compressed bgr8', 'bgr8; png compressed bgr8', 'png'])
def test_png_colour_comes_back_exactly(name: str) -> None:
    rgb = np.random.default_rng(1).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    assert np.array_equal(decode_color(compressed(name, png(rgb[..., ::-1]))), rgb)


def test_jpeg_colour_keeps_red_red() -> None:
    rgb = np.zeros((30, 40, 3), np.uint8)
    rgb[:] = (200, 40, 90)
    data = cv2.imencode('.jpg', np.ascontiguousarray(rgb[..., ::-1]))[1].tobytes()
    for name in ('jpeg', 'rgb8; jpeg compressed bgr8'):
        found = decode_color(compressed(name, data)).astype(int)
        assert np.abs(found - rgb).max() < 6  # JPEG of one colour


@pytest.mark.parametrize('name', [
    '16UC1; compressedDepth png', '16UC1; compressedDepth', 'mono16; compressedDepth'])
def test_png_depth_comes_back_in_metres(name: str, depth_mm: np.ndarray) -> None:
    found = decode_depth(compressed(name, depth_header() + png(depth_mm)))
    expected = np.where(depth_mm == 0, np.nan, depth_mm / 1000)
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_rvl_depth_comes_back_exactly(depth_mm: np.ndarray) -> None:
    message = compressed('16UC1; compressedDepth rvl', depth_header() + encode_rvl(depth_mm))
    expected = np.where(depth_mm == 0, np.nan, depth_mm / 1000)
    np.testing.assert_allclose(decode_depth(message), expected, rtol=1e-6)


def test_rvl_of_random_and_of_empty_images_comes_back() -> None:
    rng = np.random.default_rng(9)
    for image in (np.zeros((7, 9), np.uint16), rng.integers(0, 65536, (7, 9), dtype=np.uint16),
                  rng.integers(0, 2, (7, 9), dtype=np.uint16) * np.uint16(900)):
        data = depth_header() + encode_rvl(image)
        found = decode_depth(compressed('16UC1; compressedDepth rvl', data))
        np.testing.assert_allclose(np.nan_to_num(found), image / 1000, rtol=1e-6)


def test_inverse_depth_of_floats_comes_back_to_its_quantisation() -> None:
    depth_m = np.linspace(0.5, 8, 1200, dtype=np.float32).reshape(30, 40)
    depth_m[3, 4] = np.nan
    a, b = 100 * (100 / 0.005 + 1) / 100, 1 - 100 * (100 / 0.005 + 1) / 100 / 10.0
    with np.errstate(invalid='ignore'):
        raw = np.nan_to_num(np.rint(a / depth_m + b), nan=0).astype(np.uint16)
    found = decode_depth(compressed('32FC1; compressedDepth png', depth_header(a, b) + png(raw)))
    assert np.isnan(found[3, 4])
    step_m = depth_m**2 / a  # one unit of the quantised inverse
    known = np.isfinite(depth_m)
    assert np.all(np.abs(found - depth_m)[known] <= 0.51 * step_m[known] + 1e-6)


@pytest.mark.parametrize(('name', 'data', 'told'), [
    ('jpeg', b'\xff\xd8\xff', 'JPEG destroys depth'),
    ('16UC1; compressedDepth png', b'', 'header of 12 bytes'),
    ('16UC1; compressedDepth png', depth_header() + b'rubbish', '16-bit PNG or RVL'),
    ('16UC1; compressedDepth rvl', depth_header() + struct.pack('<ii', -4, 7), 'PNG or RVL'),
    ('16UC1; compressedDepth rvl', depth_header() + struct.pack('<iii', -4, 7, 0), 'image size'),
    ('16UC1; compressedDepth rvl', depth_header() + struct.pack('<iiI', 40, 30, 1 << 28),
     'expected 1200 pixels of RVL'),
])
def test_damaged_or_lossy_depth_is_named(name: str, data: bytes, told: str) -> None:
    with pytest.raises(BadMessageError, match=told):
        decode_depth(compressed(name, data))


def test_truncated_rvl_never_reads_beyond_its_end(depth_mm: np.ndarray) -> None:
    data = depth_header() + encode_rvl(depth_mm)
    for size in range(24, len(data) - 4, 97):
        with pytest.raises(BadMessageError, match='pixels of RVL'):
            decode_depth(compressed('16UC1; compressedDepth rvl', data[:size]))


def test_compressed_depth_on_the_colour_topic_is_named(depth_mm: np.ndarray) -> None:
    message = compressed('16UC1; compressedDepth png', depth_header() + png(depth_mm))
    with pytest.raises(BadMessageError, match='remapped to color/image'):
        decode_color(message)


def test_a_bag_of_compressed_images_gives_frames(tmp_path: Path, depth_mm: np.ndarray) -> None:
    rgb = np.random.default_rng(1).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    stamp = 1_700_000_000_000_000_000
    color = compressed('rgb8; png compressed bgr8', png(rgb[..., ::-1]), stamp)
    depth = compressed('16UC1; compressedDepth png', depth_header() + png(depth_mm), stamp)
    path = write_bag(tmp_path / 'a.mcap', [
        ('/cam/color/image_raw/compressed', KIND, stamp, color),
        ('/cam/aligned_depth/image_raw/compressedDepth', KIND, stamp, depth),
        (CAMERA.replace('/cam/', '/other/'), INFO, stamp, camera_info(CAM, stamp)),
        (CAMERA, INFO, stamp, camera_info(CAM, stamp)),
    ])
    with BagReader(path) as bag:
        topics = find_topics(bag)
        assert topics.info == CAMERA
        read = {m.topic: m.read() for m in bag.messages(topics.all)}
    frame = frame_from_messages(read[topics.color], read[topics.depth], read[topics.info])
    assert np.array_equal(frame.rgb, rgb)
    assert frame.depth_m[20, 5] == np.float32(depth_mm[20, 5]) * np.float32(0.001)
