"""Images and camera infos of every encoding and layout give the same arrays."""

import array
from typing import Any

import numpy as np
import pytest
from sensor_msgs.msg import Image
from support.messages import camera_info, depth_image, image

from pop_core.geometry.camera import Camera
from pop_ros.from_messages import (
    BadMessageError,
    camera_from_info,
    decode_color,
    decode_depth,
    frame_from_messages,
    stamp_ns,
)

CAMERA = Camera(12, 8, 10.0, 11.0, 5.5, 3.5)


@pytest.fixture
def rgb() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 256, (8, 12, 3), dtype=np.uint8)


@pytest.fixture
def depth_m() -> np.ndarray:
    depth = np.random.default_rng(2).integers(400, 6000, (8, 12)).astype(np.float32) / 1000
    depth[2, 3:6] = np.nan
    return depth


@pytest.mark.parametrize('padding', [0, 5])
def test_every_colour_encoding_gives_the_same_rgb(rgb: np.ndarray, padding: int) -> None:
    alpha = np.full((8, 12, 1), 9, np.uint8)
    bgr = rgb[..., ::-1]
    images = {
        'rgb8': rgb, 'bgr8': bgr, '8UC3': bgr,
        'rgba8': np.concatenate([rgb, alpha], axis=2),
        'bgra8': np.concatenate([bgr, alpha], axis=2),
    }
    for encoding, values in images.items():
        found = decode_color(image(values, encoding, padding=padding))
        assert np.array_equal(found, rgb), encoding


def test_grey_becomes_three_equal_channels(rgb: np.ndarray) -> None:
    found = decode_color(image(rgb[..., 0], 'mono8'))
    assert np.array_equal(found, np.repeat(rgb[..., :1], 3, axis=2))


@pytest.mark.parametrize('order', ['<', '>'])
@pytest.mark.parametrize('padding', [0, 6])
@pytest.mark.parametrize('encoding', ['16UC1', 'mono16', '32FC1'])
def test_every_depth_encoding_gives_metres_with_nan(
    depth_m: np.ndarray, encoding: str, padding: int, order: str
) -> None:
    if encoding == '32FC1':
        raw = depth_m.astype(f'{order}f4')
    else:
        raw = np.nan_to_num(np.rint(depth_m * 1000)).astype(f'{order}u2')
    found = decode_depth(image(raw, encoding, padding=padding))
    assert found.dtype == np.float32
    np.testing.assert_allclose(found, depth_m, rtol=1e-6)  # float32 of whole millimetres


def test_zero_negative_and_infinite_metres_are_no_measurement() -> None:
    raw = np.array([[0.0, -1.0, np.inf, np.nan, 2.0]], np.float32)
    assert np.isfinite(decode_depth(image(raw, '32FC1'))).tolist() == [[False] * 4 + [True]]


def test_the_decoded_image_does_not_share_memory_with_the_message(rgb: np.ndarray) -> None:
    message = image(rgb, 'rgb8')
    found = decode_color(message)
    message.data[:] = 0
    assert np.array_equal(found, rgb)


def test_messages_of_rclpy_and_of_bags_decode_alike(depth_m: np.ndarray) -> None:
    from_bag = depth_image(depth_m, '16UC1')
    data = array.array('B', from_bag.data.tobytes())
    live = Image(height=8, width=12, encoding='16UC1', step=24, data=data)
    assert np.array_equal(decode_depth(live), decode_depth(from_bag), equal_nan=True)


@pytest.mark.parametrize(('encoding', 'advice'), [
    ('bayer_rggb8', 'debayer'), ('16UC1', 'remapped to color/image'), ('jpeg', 'jpeg')])
def test_an_unusable_colour_encoding_is_named_with_advice(encoding: str, advice: str) -> None:
    message = image(np.zeros((8, 12), np.uint16), encoding)
    with pytest.raises(BadMessageError, match=advice):
        decode_color(message)


def test_a_colour_image_on_the_depth_topic_is_named(rgb: np.ndarray) -> None:
    with pytest.raises(BadMessageError, match=r"expected encoding 16UC1.*found 'rgb8'"):
        decode_depth(image(rgb, 'rgb8'))


@pytest.mark.parametrize('damage', ['short data', 'small step', 'no rows', 'no data'])
def test_a_malformed_image_is_refused_with_its_numbers(rgb: np.ndarray, damage: str) -> None:
    message = image(rgb, 'rgb8')
    if damage == 'short data':
        message.data = message.data[:-1]
    elif damage == 'small step':
        message.step -= 1
    elif damage == 'no rows':
        message.height = 0
    else:
        message.data = message.data[:0]
    with pytest.raises(BadMessageError, match=r'expected \d+ rows of at least 36 bytes'):
        decode_color(message)


def test_the_last_row_may_lack_its_padding(rgb: np.ndarray) -> None:
    message = image(rgb, 'rgb8', padding=7)
    message.data = message.data[:-7]
    assert np.array_equal(decode_color(message), rgb)


def test_an_uncalibrated_camera_is_named() -> None:
    with pytest.raises(BadMessageError, match='K = 0: the camera is uncalibrated'):
        camera_from_info(camera_info(CAMERA, k=np.zeros(9)))


def test_rectified_images_have_the_intrinsics_of_p_and_no_distortion() -> None:
    P = np.array([[500.0, 0, 30, 0], [0, 510.0, 20, 0], [0, 0, 1, 0]])
    info = camera_info(
        CAMERA, p=P.ravel(), d=np.array([0.1, -0.2, 0.0, 0.0, 0.0]), binning_x=2, binning_y=2)
    found = camera_from_info(info, is_rectified=True)
    assert not found.is_distorted
    assert (found.fx, found.fy, found.cx, found.cy) == (250.0, 255.0, 14.75, 9.75)
    assert camera_from_info(info).is_distorted
    with pytest.raises(BadMessageError, match='finite intrinsics'):
        camera_from_info(camera_info(CAMERA, p=np.zeros(12)), is_rectified=True)


def test_a_camera_survives_the_round_trip() -> None:
    d = np.array([0.03, 0.05, -0.001, 0.003, -0.5])
    for camera in (CAMERA, Camera(640, 480, 540.0, 541.0, 320.0, 239.0, 'plumb_bob', d),
                   Camera(640, 480, 540.0, 541.0, 320.0, 239.0, 'equidistant', d[:4])):
        found = camera_from_info(camera_info(camera))
        assert np.array_equal(found.K, camera.K)
        assert np.array_equal(found.d, camera.d)
        assert (found.width, found.height) == (camera.width, camera.height)


def test_a_point_keeps_its_place_in_a_cropped_and_binned_image() -> None:
    full = Camera(640, 480, 500.0, 520.0, 310.0, 250.0)
    info = camera_info(full, binning_x=2, binning_y=2)
    info.roi.x_offset, info.roi.y_offset, info.roi.width, info.roi.height = 100, 60, 400, 300
    small = camera_from_info(info)
    p_camera = np.array([[0.1, -0.2, 2.0], [-0.3, 0.1, 1.5]])
    # A binned pixel covers two; its centre lies between theirs.
    expected = (full.project(p_camera) - [100, 60] + 0.5) / 2 - 0.5
    np.testing.assert_allclose(small.project(p_camera), expected, atol=1e-9)
    assert (small.width, small.height) == (200, 150)


def test_an_unknown_distortion_model_is_named() -> None:
    with pytest.raises(BadMessageError, match='ftheta'):
        camera_from_info(camera_info(CAMERA, distortion_model='ftheta', d=np.ones(5)))


def test_a_frame_carries_the_colour_stamp(rgb: np.ndarray, depth_m: np.ndarray) -> None:
    color = image(rgb, 'rgb8', 1_234_567_890_987_654_321)
    frame = frame_from_messages(color, depth_image(depth_m, '32FC1', 5), camera_info(CAMERA))
    assert frame.stamp_ns == 1_234_567_890_987_654_321 == stamp_ns(color.header)


def test_unregistered_depth_is_refused_by_size_and_by_frame(rgb: np.ndarray) -> None:
    color, info = image(rgb, 'rgb8'), camera_info(CAMERA)
    small: Any = depth_image(np.ones((4, 6), np.float32), '32FC1')
    with pytest.raises(BadMessageError, match='depth image 6x4'):
        frame_from_messages(color, small, info)
    other = image(np.ones((8, 12), np.float32), '32FC1', frame_id='depth_frame')
    with pytest.raises(BadMessageError, match=r"found depth in frame 'depth_frame'.*registration"):
        frame_from_messages(color, other, info)
