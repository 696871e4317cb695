"""Kernels of E_free against slow twins in numpy."""

import numpy as np

from pop_core.fitting.depth_consistency import Sight
from pop_core.fitting.free_space_kernels import (
    gaps_along_rays,
    hidden_places,
    hiding_slices,
    pulls_aside,
)
from pop_core.fitting.robust_loss import geman_mcclure_weight
from pop_core.geometry.camera import Camera
from pop_core.geometry.nearest_pixel_kernels import nearest_rows

CAMERA = Camera(60, 40, 50.0, 50.0, 29.5, 19.5)


def cloud(n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return CAMERA.unproject(rng.uniform([0, 0], [59, 39], (n, 2)), rng.uniform(1.0, 3.0, n))


def test_small_gaps_are_closed_along_the_ray_and_large_ones_are_named() -> None:
    rng = np.random.default_rng(0)
    points, gap = cloud(80, 1), rng.uniform(0.0, 0.3, 80)
    sight = rng.choice([Sight.VISIBLE, Sight.CONTRADICTED, Sight.UNKNOWN], 80).astype(np.int64)
    (vertex, direction, target, weight), large = gaps_along_rays(points, sight, gap, 0.12, 7.0)
    broken = sight == Sight.CONTRADICTED
    np.testing.assert_array_equal(vertex, np.flatnonzero(broken & (gap <= 0.12)))
    np.testing.assert_array_equal(large, np.flatnonzero(broken & (gap > 0.12)))
    seen = points[vertex]
    np.testing.assert_allclose(direction, seen / np.linalg.norm(seen, axis=1, keepdims=True))
    np.testing.assert_allclose(target, seen * (1 + gap[vertex] / seen[:, 2])[:, None])
    np.testing.assert_array_equal(weight, 7.0)


def test_the_slice_of_a_depth_begins_before_it() -> None:
    slices = np.linspace(1.0, 2.0, 5)
    z = np.array([0.5, 1.0, 1.24, 1.25, 1.9, 2.0, 9.0])
    expected = np.clip(np.searchsorted(slices, z, side='right') - 1, 0, 4)
    np.testing.assert_array_equal(hiding_slices(z, slices), expected)


def test_the_nearest_place_that_hides_is_found_at_the_depth_of_the_point() -> None:
    mask = np.random.default_rng(2).random((20, 30)) < 0.02
    points, chosen = cloud(50, 3), np.arange(50) % 3 > 0
    out = np.full((50, 3), np.nan)
    hidden_places(
        nearest_rows(mask), points, chosen, CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy,
        CAMERA.ray_grid(), out)
    places = np.argwhere(mask)[:, ::-1]  # (u, v) of every other pixel
    asking = np.rint(CAMERA.project(points)).astype(int) // 2
    apart = np.linalg.norm(asking[:, None] - places, axis=2).min(axis=1)
    found = np.rint(CAMERA.project(out[chosen])).astype(int)
    assert mask[found[:, 1] // 2, found[:, 0] // 2].all()
    np.testing.assert_allclose(
        np.linalg.norm(found // 2 - asking[chosen], axis=1), apart[chosen])
    np.testing.assert_array_equal(out[chosen, 2], points[chosen, 2])
    assert np.isnan(out[~chosen]).all()


def test_where_nothing_hides_there_is_no_place() -> None:
    out = np.full((4, 3), np.nan)
    hidden_places(
        nearest_rows(np.zeros((20, 30), dtype=bool)), cloud(4, 4), np.ones(4, dtype=bool),
        CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy, CAMERA.ray_grid(), out)
    assert np.isnan(out).all()


def test_pulls_weigh_what_the_kernel_says_along_both_axes() -> None:
    vertices, target = cloud(30, 5), cloud(12, 6)
    vertex = np.random.default_rng(7).integers(0, 30, 12)
    found, direction, to, weight = pulls_aside(vertices, vertex, target, 5.0, 0.3)
    pull = np.linalg.norm(vertices[vertex] - target, axis=1)
    np.testing.assert_array_equal(found, np.tile(vertex, 2))
    np.testing.assert_array_equal(direction, np.repeat(np.eye(2, 3), 12, axis=0))
    np.testing.assert_array_equal(to, np.tile(target, (2, 1)))
    np.testing.assert_allclose(weight, np.tile(5.0 * geman_mcclure_weight(pull, 0.3), 2))
