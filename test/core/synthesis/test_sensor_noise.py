import numpy as np
import pytest

from pop_core.geometry.camera import Camera
from pop_core.synthesis.sensor_noise import SENSORS, stereo, structured_light, time_of_flight

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
LIT = np.zeros((480, 640), dtype=bool)


def wall(z_m):
    return np.full((480, 640), z_m, dtype=np.float32)


def box_before_wall(near_m, far_m):
    depth_m = wall(far_m)
    depth_m[150:350, 250:400] = near_m
    return depth_m


@pytest.mark.parametrize('name', sorted(SENSORS))
def test_missing_is_nan_and_everything_else_a_distance(name):
    depth_m = box_before_wall(1.2, 3.0)
    depth_m[:40] = np.inf
    out = SENSORS[name](depth_m, CAMERA, LIT, np.random.default_rng(0))
    assert out.dtype == np.float32
    assert np.isnan(out[:38]).all()
    measured = out[np.isfinite(out)]
    assert measured.min() > 0.2
    assert np.isfinite(out[60:]).mean() > 0.85


@pytest.mark.parametrize('name', sorted(SENSORS))
def test_a_seed_gives_the_same_noise_twice(name):
    first, second = (
        SENSORS[name](box_before_wall(1.5, 2.5), CAMERA, LIT, np.random.default_rng(3))
        for _ in range(2))
    assert np.array_equal(first, second, equal_nan=True)


@pytest.mark.parametrize('name', sorted(SENSORS))
def test_a_wall_is_measured_within_two_percent(name):
    out = SENSORS[name](wall(2.0), CAMERA, LIT, np.random.default_rng(1))
    assert np.nanmean(out) == pytest.approx(2.0, rel=0.01)
    assert np.nanstd(out) < 0.04


def test_structured_light_noise_follows_its_law():
    for z in (1.0, 2.0):
        out = structured_light(wall(z), CAMERA, LIT, np.random.default_rng(2))
        step = z**2 / (525.0 * 0.075) / 8  # of an eighth of a pixel of disparity
        expected = np.hypot(0.0012 + 0.0019 * (z - 0.4) ** 2, step / np.sqrt(12))
        assert np.nanstd(out) == pytest.approx(expected, rel=0.25)


def test_structured_light_depths_are_steps_of_disparity():
    out = structured_light(wall(3.0), CAMERA, LIT, np.random.default_rng(2))
    eighths = 8 * 525.0 * 0.075 / out[np.isfinite(out)]
    assert np.abs(eighths - np.rint(eighths)).max() < 1e-3


def test_the_shadow_lies_on_the_side_away_from_the_projector_and_is_as_wide_as_the_parallax():
    out = structured_light(box_before_wall(1.0, 2.5), CAMERA, LIT, np.random.default_rng(0))
    missing = np.isnan(out[200:300])
    expected_px = 525.0 * 0.075 * (1 / 1.0 - 1 / 2.5)
    left, right = missing[:, 200:250].sum(axis=1), missing[:, 400:450].sum(axis=1)
    assert left.mean() == pytest.approx(expected_px, abs=2.5)
    assert right.mean() < 2


def test_stereo_noise_grows_with_the_square_of_distance():
    near, far = (
        np.nanstd(stereo(wall(z), CAMERA, LIT, np.random.default_rng(5))) for z in (1.5, 3.0))
    assert far / near == pytest.approx(4.0, rel=0.1)


def test_time_of_flight_has_pixels_that_fly_between_two_surfaces():
    depth_m = box_before_wall(1.0, 2.5)
    out = time_of_flight(depth_m, CAMERA, LIT, np.random.default_rng(4))
    between = (out > 1.1) & (out < 2.4)
    assert between.sum() > 100
    away = np.zeros((480, 640), dtype=bool)
    away[155:345, 255:395] = True
    assert not (between & away).any()


def test_dark_cloth_is_lost_more_often():
    dark = np.zeros((480, 640), dtype=bool)
    dark[:, :320] = True
    for sensor in (structured_light, time_of_flight, stereo):
        out = sensor(wall(3.0), CAMERA, dark, np.random.default_rng(6))
        assert np.isnan(out[:, :320]).mean() > np.isnan(out[:, 320:]).mean() + 0.02
