"""Frames are what they promise, or are refused."""

import numpy as np
import pytest

from pop_core.errors import FrameError
from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame, clean_depth, point_cloud

CAMERA = Camera(8, 6, 10.0, 10.0, 3.5, 2.5)
RGB = np.zeros((6, 8, 3), dtype=np.uint8)


def unchecked(rgb: np.ndarray, depth_m: np.ndarray, stamp_ns: object = 0) -> None:
    """Check a frame as users have it, without the types that tests are checked with."""
    frame = object.__new__(RgbdFrame)
    fields = {'rgb': rgb, 'depth_m': depth_m, 'camera': CAMERA, 'stamp_ns': stamp_ns}
    for name, value in fields.items():
        object.__setattr__(frame, name, value)
    frame.__post_init__()


def depth_with(value: float) -> np.ndarray:
    depth_m = np.full((6, 8), 2.0, dtype=np.float32)
    depth_m[2, 3] = value
    return depth_m


def test_another_size_than_the_camera_s_is_told() -> None:
    with pytest.raises(FrameError, match='of 8x6 as the camera says, found colour'):
        RgbdFrame(RGB[:5], depth_with(2.0)[:5], CAMERA)


@pytest.mark.parametrize('value', [0.0, -1.0, np.inf, -np.inf])
def test_what_is_no_distance_is_told_with_what_to_do(value: float) -> None:
    with pytest.raises(FrameError, match=r'found 1 pixels of 0.*clean_depth'):
        RgbdFrame(RGB, depth_with(value), CAMERA)
    cleaned = RgbdFrame(RGB, clean_depth(depth_with(value)), CAMERA)
    assert np.isnan(cleaned.depth_m[2, 3])


@pytest.mark.parametrize('kind', [np.float64, np.uint16])
def test_depth_of_another_type_is_told_with_what_to_do(kind: type) -> None:
    with pytest.raises(FrameError, match=r'expected depth in metres as float32, found.*1000'):
        unchecked(RGB, depth_with(2.0).astype(kind))


@pytest.mark.parametrize('rgb', [
    RGB[..., 0], np.dstack([RGB, RGB[..., :1]]), RGB.astype(np.float32)])
def test_colour_of_another_kind_is_told_with_what_to_do(rgb: np.ndarray) -> None:
    with pytest.raises(FrameError, match=r'expected colour as uint8 .*found .*cv2.cvtColor'):
        unchecked(rgb, depth_with(2.0))


@pytest.mark.parametrize('stamp_ns', [1.7e9, '17', None])
def test_a_stamp_that_is_no_integer_is_told_with_what_to_do(stamp_ns: object) -> None:
    with pytest.raises(FrameError, match=rf'found {stamp_ns!r}: .*1e9'):
        unchecked(RGB, depth_with(2.0), stamp_ns)


def test_stamps_of_numpy_are_integers_too() -> None:
    unchecked(RGB, depth_with(2.0), np.int64(17))


def test_pixels_without_a_measurement_are_fine() -> None:
    assert np.isnan(RgbdFrame(RGB, depth_with(np.nan), CAMERA).depth_m).sum() == 1


def test_points_of_a_distorted_image_lie_on_the_rays_of_their_pixels() -> None:
    bent = Camera(160, 120, 130.0, 132.0, 81.0, 58.0, 'plumb_bob',
                  np.array([-0.3, 0.1, 0.001, -0.002, 0.0]))
    depth_m = np.random.default_rng(0).uniform(0.5, 4.0, (120, 160)).astype(np.float32)
    frame = RgbdFrame(np.zeros((120, 160, 3), dtype=np.uint8), depth_m, bent)
    points, uv = point_cloud(frame, depth_m > 1.0)
    assert len(points) == (depth_m > 1.0).sum()
    np.testing.assert_allclose(bent.project(points), uv, atol=1e-3)
