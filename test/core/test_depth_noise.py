import numpy as np
import pytest

from pop_core.depth_noise import DepthNoise, estimate_depth_noise
from pop_core.geometry.camera import Camera
from pop_core.synthesis.sensor_noise import time_of_flight

CAMERA = Camera(320, 240, 262.0, 262.0, 159.5, 119.5)


def room(noise_per_m: float, seed: int = 0) -> np.ndarray:
    """A floor, a slanted wall and a box, with disparity noise."""
    x, y = np.moveaxis(CAMERA.ray_grid(), -1, 0)
    depth = np.minimum(1.2 / np.maximum(y, 1e-3), 4.0 / (1.0 + 0.3 * x))
    depth[100:160, 120:200] = 2.0
    noise = np.random.default_rng(seed).normal(size=depth.shape) * noise_per_m * depth**2
    return (depth + noise).astype(np.float32)


@pytest.mark.parametrize('per_m', [0.0005, 0.002, 0.006])
def test_disparity_noise_is_measured_in_a_room_of_planes(per_m: float) -> None:
    assert estimate_depth_noise(room(per_m), CAMERA.fx).per_m == pytest.approx(per_m, rel=0.15)


def test_holes_do_not_matter() -> None:
    depth = room(0.002)
    depth[np.random.default_rng(1).random(depth.shape) < 0.3] = np.nan
    depth[:, 50:60] = 0.0
    assert estimate_depth_noise(depth, CAMERA.fx).per_m == pytest.approx(0.002, rel=0.15)


def test_a_time_of_flight_camera_is_less_noisy_than_the_usual_sensor() -> None:
    clean = room(0.0)
    seen = time_of_flight(
        clean, CAMERA, np.zeros(clean.shape, dtype=bool), np.random.default_rng(2))
    assert estimate_depth_noise(seen, CAMERA.fx).per_m < DepthNoise().per_m


def test_with_nothing_measured_the_usual_noise_is_assumed() -> None:
    assert estimate_depth_noise(np.full((48, 64), np.nan, dtype=np.float32), 262.0) == DepthNoise()
    assert estimate_depth_noise(np.full((5, 5), 2.0, dtype=np.float32), 262.0) == DepthNoise()


def test_noise_grows_with_the_square_of_depth() -> None:
    sigma = DepthNoise(0.002).sigma_m(np.array([1.0, 2.0, 4.0]))
    growth = np.diff(sigma) / np.diff(np.array([1.0, 4.0, 16.0]))
    assert np.allclose(growth, 0.002)


@pytest.mark.parametrize('finer', [2, 3, 4])
def test_depth_aligned_to_a_finer_image_is_as_noisy_as_it_was_measured(finer: int) -> None:
    measured_m = room(0.002)
    aligned_m = np.kron(measured_m, np.ones((finer, finer), dtype=np.float32))
    noise = estimate_depth_noise(aligned_m, finer * CAMERA.fx)
    assert noise.per_m == pytest.approx(0.002, rel=0.15)
