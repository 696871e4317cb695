"""Registered depth is what the colour camera would have measured."""

import numpy as np
import pytest

from pop_core.errors import FrameError
from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec
from pop_core.geometry.transform import make_transform
from pop_core.rendering.depth_registration import DepthRegistration

DEPTH_CAMERA = Camera(160, 120, 140.0, 142.0, 80.5, 58.5)
COLOR_CAMERA = Camera(320, 240, 250.0, 251.0, 158.0, 121.0)
T_COLOR_DEPTH = make_transform(
    from_rotvec(np.array([0.01, -0.02, 0.015])), np.array([0.05, -0.01, 0.004]))


def plane_depth(
    camera: Camera, normal: np.ndarray, offset_m: float
) -> np.ndarray:
    """Return the depth of the plane n·p = offset in a camera's frame."""
    rays = camera.ray_grid()
    along = rays @ normal[:2] + normal[2]
    return (offset_m / along).astype(np.float32)


def moved_plane(T: np.ndarray, normal: np.ndarray, offset_m: float) -> tuple[np.ndarray, float]:
    turned = T[:3, :3] @ normal
    return turned, offset_m + float(turned @ T[:3, 3])


@pytest.mark.parametrize('d', [np.zeros(0), np.array([0.08, -0.05, 0.001, -0.002, 0.01])])
def test_a_slanted_plane_is_measured_where_the_colour_camera_sees_it(d: np.ndarray) -> None:
    color = Camera(320, 240, 250.0, 251.0, 158.0, 121.0, 'plumb_bob' if d.size else '', d)
    normal = np.array([0.2, 0.3, 0.93])
    found = DepthRegistration(DEPTH_CAMERA, color, T_COLOR_DEPTH).apply(
        plane_depth(DEPTH_CAMERA, normal, 2.0))
    expected = plane_depth(color, *moved_plane(T_COLOR_DEPTH, normal, 2.0))
    inner = np.isfinite(found)
    assert inner[30:-30, 40:-40].all()  # finer than the depth image, and yet no holes
    # Depth is linear between pixels only in 1/z; a distorted pixel is rounded to the nearest.
    atol = 0.006 if d.size else 1e-4
    np.testing.assert_allclose(found[inner], expected[inner], atol=atol)


def test_the_same_camera_gives_the_same_depth() -> None:
    depth_m = plane_depth(DEPTH_CAMERA, np.array([0.1, 0.0, 1.0]), 1.5)
    found = DepthRegistration(DEPTH_CAMERA, DEPTH_CAMERA, np.eye(4)).apply(depth_m)
    np.testing.assert_allclose(found[1:-1, 1:-1], depth_m[1:-1, 1:-1], rtol=1e-5)


def test_what_stands_in_front_hides_what_is_behind() -> None:
    depth_m = np.full((120, 160), 3.0, np.float32)
    depth_m[40:80, 60:100] = 1.0
    shifted = make_transform(np.eye(3), np.array([0.1, 0.0, 0.0]))
    found = DepthRegistration(DEPTH_CAMERA, DEPTH_CAMERA, shifted).apply(depth_m)
    near, far = 140.0 * 0.1 / 1.0, 140.0 * 0.1 / 3.0  # shifts in pixels
    assert np.all(found[45:75, int(60 + near) + 2: int(99 + near) - 1] < 1.001)
    # Between the old place of the block and its new one nobody has looked: no depth is invented.
    gap = found[45:75, int(60 + far) + 2: int(60 + near) - 1]
    assert np.isnan(gap).all()


def test_holes_and_jumps_carry_no_surface() -> None:
    depth_m = np.full((6, 7), 2.0, np.float32)
    depth_m[2, 3] = np.nan
    depth_m[:, 5:] = 4.0
    coarse = Camera(7, 6, 8.0, 8.0, 3.0, 2.5)
    fine = Camera(25, 21, 32.0, 32.0, 12.0, 10.0)  # four of its pixels to one, centres on centres
    found = DepthRegistration(coarse, fine, np.eye(4)).apply(depth_m)
    assert np.isnan(found[5:12, 9:16]).all()  # inside the four squares around the hole
    assert np.isnan(found[:, 17:20]).all()  # across the jump
    np.testing.assert_allclose(found[1:4, 1:16], 2.0, rtol=1e-6)
    np.testing.assert_allclose(found[1:-1, 21:24], 4.0, rtol=1e-6)


def test_an_image_without_depth_gives_none() -> None:
    registration = DepthRegistration(DEPTH_CAMERA, COLOR_CAMERA, T_COLOR_DEPTH)
    found = registration.apply(np.full((120, 160), np.nan, np.float32))
    assert found.shape == (240, 320)
    assert np.isnan(found).all()


def test_depth_of_another_size_is_refused() -> None:
    with pytest.raises(FrameError, match='expected 160x120'):
        DepthRegistration(DEPTH_CAMERA, COLOR_CAMERA, T_COLOR_DEPTH).apply(
            np.ones((10, 10), np.float32))
