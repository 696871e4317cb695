from dataclasses import replace

import numpy as np
import pytest

from pop_core.errors import CameraError
from pop_core.geometry.camera import Camera

PINHOLE = Camera(640, 480, 525.0, 520.0, 319.5, 239.5)
BROWN = Camera(640, 480, 525.0, 520.0, 319.5, 239.5, 'plumb_bob',
               np.array([0.05, -0.1, 0.001, -0.002, 0.03]))
RATIONAL = Camera(640, 480, 525.0, 520.0, 319.5, 239.5, 'rational_polynomial',
                  np.array([0.4, -2.3, 0.0005, -0.0002, 1.4, 0.3, -2.1, 1.3]))
FISHEYE = Camera(640, 480, 380.0, 380.0, 319.5, 239.5, 'equidistant',
                 np.array([0.02, -0.01, 0.003, -0.001]))
EVERY = pytest.mark.parametrize('camera', [PINHOLE, BROWN, RATIONAL, FISHEYE],
                                ids=['pinhole', 'brown', 'rational', 'fisheye'])


def test_point_on_the_optical_axis_projects_to_the_principal_point() -> None:
    np.testing.assert_allclose(PINHOLE.project(np.array([[0.0, 0.0, 2.0]])), [[319.5, 239.5]])


@EVERY
def test_projection_undoes_unprojection(camera: Camera) -> None:
    rng = np.random.default_rng(0)
    uv = rng.uniform([20, 20], [620, 460], (200, 2))
    p = camera.unproject(uv, rng.uniform(0.5, 6.0, 200))
    np.testing.assert_allclose(camera.project(p), uv, atol=1e-3)  # a thousandth of a pixel


@EVERY
def test_ray_grid_agrees_with_unprojection(camera: Camera) -> None:
    expected = camera.unproject(np.array([[100.0, 50.0]]), np.ones(1))[0, :2]
    np.testing.assert_allclose(camera.ray_grid()[50, 100], expected, atol=1e-9)


def test_points_behind_the_camera_have_no_pixel() -> None:
    assert np.isnan(PINHOLE.project(np.array([[0.1, 0.1, -1.0]]))).all()


def test_resizing_keeps_the_image_corners() -> None:
    half = PINHOLE.resized(0.5)
    corner = PINHOLE.unproject(np.array([[-0.5, -0.5]]), np.ones(1))
    np.testing.assert_allclose(half.project(corner), [[-0.5, -0.5]], atol=1e-12)


@pytest.mark.parametrize(('model', 'd'), [('fov', [0.1]), ('plumb_bob', [0.1, 0.2]),
                                          ('plumb_bob', [np.nan] * 5)])
def test_unknown_or_incomplete_distortion_is_refused(model: str, d: list[float]) -> None:
    with pytest.raises(CameraError, match='expected'):
        Camera(640, 480, 525.0, 525.0, 320.0, 240.0, model, np.array(d))


PRISM = Camera(640, 480, 525.0, 520.0, 319.5, 239.5, 'rational_polynomial', np.array(
    [0.4, -2.3, 0.0005, -0.0002, 1.4, 0.3, -2.1, 1.3, 0.002, -0.001, 0.003, 0.001]))


@pytest.mark.parametrize('camera', [PINHOLE, BROWN, RATIONAL, FISHEYE, PRISM])
def test_a_camera_turned_by_a_quarter_sees_points_at_the_turned_pixels(camera: Camera) -> None:
    rng = np.random.default_rng(0)
    p = rng.uniform([-1, -0.8, 2], [1, 0.8, 4], (50, 3))
    u, v = camera.project(p).T
    turned = camera.turned().project(np.column_stack([p[:, 1], -p[:, 0], p[:, 2]]))
    np.testing.assert_allclose(turned, np.column_stack([v, 639 - u]), atol=1e-6)


def test_a_camera_turned_four_times_is_itself() -> None:
    again = BROWN.turned().turned().turned().turned()
    assert again.sees_like(BROWN, 1e-9)


def test_a_tilted_sensor_cannot_be_turned() -> None:
    tilted = Camera(640, 480, 525.0, 520.0, 319.5, 239.5, 'rational_polynomial', np.full(14, 0.01))
    with pytest.raises(CameraError, match='tilted'):
        tilted.turned()


@pytest.mark.parametrize('turns', [-1, 4])
def test_other_than_quarter_turns_are_refused(turns: int) -> None:
    with pytest.raises(CameraError, match='0 to 3 quarter turns'):
        replace(PINHOLE, quarter_turns=turns)


def test_coefficients_as_opencv_calibrates_them_are_one_row() -> None:
    camera = Camera(640, 480, 525.0, 525.0, 320.0, 240.0, 'plumb_bob', np.zeros(5))
    object.__setattr__(camera, 'd', np.full((1, 5), 0.1))  # tests are checked for their types
    camera.__post_init__()
    assert camera.d.shape == (5,)


def test_zero_focal_length_is_named_as_uncalibrated() -> None:
    with pytest.raises(CameraError, match='calibrated'):
        Camera(640, 480, 0.0, 0.0, 0.0, 0.0)
