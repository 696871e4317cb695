"""People brought near keep their size, their relief, and their place in the camera's frame."""

import numpy as np
import pytest

from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth import LARGEST_SIDE, canonical_view
from pop_core.keypoints.close_view import (
    BEFORE_M,
    FINEST,
    SHOWN_AT_M,
    SIDES_PX,
    NetworkView,
    close_depth,
    close_view,
)

FOCAL_PX = 160.0
VGA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
BENT = Camera(640, 480, 525.0, 525.0, 319.5, 239.5, 'plumb_bob',
              np.array([0.1, -0.2, 0.001, 0.001, 0.05]))


def somebody(z_m, x_m=0.0, height_m=1.4):
    """Return joints in a plane at some depth, and the depth of the skin before them."""
    rng = np.random.default_rng(3)
    joints = rng.uniform([-0.25, -0.5, 0], [0.25, 0.5, 0], (15, 3)) * [1, height_m, 0]
    return joints + [x_m, 0.0, z_m + 0.1], z_m


def view_of(camera, z_m, x_m=0.0, height_m=1.4):
    joints, surface_m = somebody(z_m, x_m, height_m)
    fine = canonical_view(
        camera, camera.ray_grid(), FINEST * FOCAL_PX, FINEST * LARGEST_SIDE)
    enlarged = max(surface_m / SHOWN_AT_M, 1.0)
    before_m = BEFORE_M if enlarged > 1.0 else np.inf
    return close_view(FOCAL_PX, enlarged, joints, surface_m, fine, before_m), fine


@pytest.mark.parametrize('enlarged', [1.0, 2.7])
def test_points_come_back_from_what_a_network_is_shown(enlarged):
    view = NetworkView(Camera(96, 96, 160.0, 160.0, 40.0, 50.0), enlarged, 1.3)
    points = np.random.default_rng(0).uniform([-1, -1, 2], [1, 1, 6], (20, 15, 3))
    np.testing.assert_allclose(view.to_camera(view.from_camera(points)), points, atol=1e-12)


@pytest.mark.parametrize('z_m', [2.0, 3.0, 6.0])
def test_somebody_far_is_shown_as_large_and_as_thick_at_the_near_depth(z_m):
    view, _ = view_of(VGA, z_m)
    ends = np.array([[-0.3, -0.8, z_m], [0.3, 0.8, z_m], [0.0, 0.0, z_m + 0.2]])
    shown = view.from_camera(ends)
    np.testing.assert_allclose(shown[:2, 2], SHOWN_AT_M)
    np.testing.assert_allclose(shown[1] - shown[0], ends[1] - ends[0], atol=1e-9)
    assert shown[2, 2] - shown[0, 2] == pytest.approx(0.2)


def test_somebody_too_near_for_a_network_of_near_looks_is_shown_farther():
    joints, surface_m = somebody(1.0)
    fine = canonical_view(VGA, VGA.ray_grid(), FINEST * FOCAL_PX, FINEST * LARGEST_SIDE)
    view = close_view(FOCAL_PX, 0.5, joints, surface_m, fine)
    ends = np.array([[-0.3, -0.4, 1.0], [0.3, 0.4, 1.0], [0.0, 0.0, 1.2]])
    shown = view.from_camera(ends)
    np.testing.assert_allclose(shown[:, 2], [2.0, 2.0, 2.2])
    np.testing.assert_allclose(shown[1] - shown[0], ends[1] - ends[0], atol=1e-9)
    np.testing.assert_allclose(view.to_camera(shown), ends, atol=1e-12)
    shown_m = close_depth(np.full((480, 640), 1.0, np.float32), fine, view)
    np.testing.assert_allclose(shown_m[shown_m > 0], 2.0, atol=1e-6)
    assert view.nearest_m == pytest.approx(2.0 - BEFORE_M)


def test_somebody_near_is_shown_where_they_are():
    view, _ = view_of(VGA, 1.1)
    points = somebody(1.1)[0]
    np.testing.assert_allclose(view.to_camera(points), points, atol=1e-12)


@pytest.mark.parametrize('z_m', [1.0, 2.5, 5.0])
@pytest.mark.parametrize('x_m', [-0.2, 0.3])
def test_views_hold_the_joints_and_fit_the_network(z_m, x_m):
    view, _ = view_of(VGA, z_m, x_m, height_m=0.8)
    uv = view.camera.project(view.from_camera(somebody(z_m, x_m, height_m=0.8)[0]))
    assert (uv >= 0).all()
    assert (uv <= [view.camera.width - 1, view.camera.height - 1]).all()
    for side in (view.camera.width, view.camera.height):
        assert side % 32 == 0
        assert SIDES_PX[0] <= side <= SIDES_PX[1]


def test_somebody_at_the_side_of_a_wide_camera_is_shown():
    wide = Camera(640, 576, 252.0, 252.0, 319.5, 287.5)
    view, fine = view_of(wide, 2.0, x_m=2.1)
    shown = close_depth(np.full((576, 640), 2.0, np.float32), fine, view)
    assert (shown > 0).all()


def test_what_lies_beyond_the_border_is_not_shown():
    inside, _ = view_of(VGA, 2.5)
    narrow = Camera(640, 200, 525.0, 525.0, 319.5, 99.5)
    cut, _ = view_of(narrow, 2.5)
    assert cut.camera.height < inside.camera.height


def test_joints_far_outside_the_image_still_make_a_view():
    view, fine = view_of(VGA, 2.0, x_m=9.0)
    assert (close_depth(np.full((480, 640), 2.0, np.float32), fine, view) >= 0).all()


@pytest.mark.parametrize('camera', [VGA, BENT], ids=['vga', 'distorted'])
def test_shown_pixels_are_the_measured_ones_on_their_rays(camera):
    view, fine = view_of(camera, 3.0, 0.2)
    rays = camera.ray_grid()
    # Depth that tells the ray it was measured on.
    measured = (4.0 + rays[..., 0] + 0.1 * rays[..., 1]).astype(np.float32)
    shown_m = close_depth(measured, fine, view)
    v, u = np.mgrid[:view.camera.height, :view.camera.width]
    pixels = np.column_stack([u.ravel(), v.ravel()]).astype(float)
    real = view.to_camera(view.camera.unproject(pixels, shown_m.ravel().astype(float)))
    known = shown_m.ravel() > 0
    assert known.mean() > 0.8
    x, y = (real[known, :2] / real[known, 2:]).T
    # Read from the nearest pixel of a grid that is read from the nearest pixel.
    np.testing.assert_allclose(real[known, 2], 4.0 + x + 0.1 * y, atol=2.5 / 525)


def test_missing_depth_is_shown_as_missing():
    view, fine = view_of(VGA, 3.0)
    assert not close_depth(np.full((480, 640), np.nan, np.float32), fine, view).any()


def test_what_stands_far_before_a_far_person_is_left_out():
    view, fine = view_of(VGA, 5.0)
    for z_m, shown in ((1.0, False), (4.0, False), (4.5, True), (6.0, True)):
        assert close_depth(np.full((480, 640), z_m, np.float32), fine, view).any() == shown


def test_nothing_is_left_out_before_a_near_person():
    view, fine = view_of(VGA, 1.2)
    assert close_depth(np.full((480, 640), 0.3, np.float32), fine, view).any()
