"""Planes are found whichever way they face, people are none."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import WALL_M, facing_person, photograph

from pop_core.body.default_body import default_body
from pop_core.depth_noise import DepthNoise
from pop_core.geometry.camera import Camera
from pop_core.segmentation.flat_surfaces import find_planes, pieces_of_plane

CAMERA = Camera(160, 120, 140.0, 140.0, 79.5, 59.5)
NOISE = DepthNoise(0.001)


def depth_of(normal: np.ndarray, offset_m: float) -> np.ndarray:
    rays = np.dstack([CAMERA.ray_grid(), np.ones((CAMERA.height, CAMERA.width))])
    z = -offset_m / (rays @ normal)
    z[(z < 0.5) | (z > 8.0)] = np.nan
    noise = np.random.default_rng(0).normal(size=z.shape) * NOISE.sigma_m(np.nan_to_num(z))
    return (z + noise).astype(np.float32)


@pytest.mark.parametrize('direction', [(0.0, 0.0, -1.0), (0.3, -0.2, -1.0), (0.0, -1.0, -0.6)])
def test_a_noisy_plane_is_found_as_it_is(direction: tuple[float, float, float]) -> None:
    normal = np.array(direction) / np.linalg.norm(direction)
    depth_m = depth_of(normal, 2.0)
    first, *others = find_planes(depth_m, CAMERA, NOISE)
    turned = first * np.sign(first[:3] @ normal)
    np.testing.assert_allclose(turned[:3], normal, atol=0.01)  # noise of many pixels
    assert turned[3] == pytest.approx(2.0, abs=0.02)
    assert not others


def test_two_planes_are_two_and_their_pixels_are_told_apart() -> None:
    left, right = depth_of(np.array([0.0, 0, -1]), 2.0), depth_of(np.array([0.0, 0, -1]), 3.0)
    depth_m = np.where(np.arange(160) < 70, left, right)
    planes = find_planes(depth_m, CAMERA, NOISE)
    assert len(planes) == 2
    for plane in planes:
        number, area_m2 = pieces_of_plane(
            plane, depth_m, CAMERA.ray_grid(), CAMERA, NOISE)
        z = abs(plane[3])
        columns = 70 if z < 2.5 else 90
        whole_m2 = columns * 120 * (z / CAMERA.fx) ** 2
        assert area_m2.max() == pytest.approx(whole_m2, rel=0.15)  # margins cost pixels of noise
        on = number == int(np.argmax(area_m2))
        assert on[:, :70].mean() == pytest.approx(float(z < 2.5), abs=0.15)


def test_areas_are_those_of_pixels_that_are_not_square() -> None:
    tall = replace(CAMERA, fy=2.0 * CAMERA.fy)
    depth_m = np.full((CAMERA.height, CAMERA.width), 2.0, dtype=np.float32)
    plane = np.array([0.0, 0.0, -1.0, 2.0])
    _, square = pieces_of_plane(plane, depth_m, CAMERA.ray_grid(), CAMERA, NOISE)
    _, flat = pieces_of_plane(plane, depth_m, tall.ray_grid(), tall, NOISE)
    assert flat.max() == pytest.approx(square.max() / 2.0)


def test_people_are_not_flat() -> None:
    body = default_body()
    frame = photograph(body, facing_person(np.zeros(10)))
    plane, *others = find_planes(frame.depth_m, frame.camera, NOISE)
    assert not others
    number, _ = pieces_of_plane(
        plane, frame.depth_m, frame.camera.ray_grid(), frame.camera, NOISE)
    wall = frame.depth_m == WALL_M
    assert (number > 0)[wall].all()
    assert not (number > 0)[~wall].any()


def test_nothing_measured_has_no_planes() -> None:
    blind = np.full((CAMERA.height, CAMERA.width), np.nan, dtype=np.float32)
    assert find_planes(blind, CAMERA, NOISE).shape == (0, 4)
