"""Surface is followed by small steps of depth, as a slow twin does it, pass by pass."""

import numpy as np

from pop_core.geometry.camera import Camera
from pop_core.segmentation.growth_kernels import creep

CAMERA = Camera(40, 30, 45.0, 50.0, 19.5, 14.5)
STEP_M, PER_SQUARE = 0.02, 0.004
CENTRES, REACH_M = np.array([[0.0, 0.0, 2.0], [0.5, 0.2, 2.2]]), np.array([0.5, 0.3])


def crept(inside: np.ndarray, allowed: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    out = inside.copy()
    creep(out, allowed, depth_m, STEP_M, PER_SQUARE, CENTRES, REACH_M,
          CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy)
    return out


def slow_twin(inside: np.ndarray, allowed: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    points = np.dstack([CAMERA.ray_grid(), np.ones(depth_m.shape)]) * depth_m[..., None]
    away_m = np.linalg.norm(points[:, :, None] - CENTRES, axis=-1)
    may_join = allowed & (away_m < REACH_M).any(axis=-1)
    out, before = inside.copy(), None
    while not np.array_equal(out, before):
        before = out.copy()
        for y, x in np.argwhere(before):
            step_m = STEP_M + PER_SQUARE * depth_m[y, x] ** 2
            for ny, nx in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                if 0 <= ny < 30 and 0 <= nx < 40 and may_join[ny, nx]:
                    out[ny, nx] |= abs(depth_m[ny, nx] - depth_m[y, x]) < step_m
    return out


def test_the_kernel_does_what_its_slow_twin_does() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        slope = rng.normal(size=2) * 0.004
        depth_m = (2.0 + slope[0] * np.arange(30)[:, None] + slope[1] * np.arange(40)
                   + 0.015 * rng.normal(size=(30, 40))).astype(np.float32)
        depth_m[:, 25:] += np.float32(rng.choice([0.0, 0.1]))
        depth_m[rng.random((30, 40)) < 0.05] = np.nan
        allowed = rng.random((30, 40)) < 0.9
        inside = np.zeros((30, 40), dtype=bool)
        inside[15, 20] = np.isfinite(depth_m[15, 20])
        expected = slow_twin(inside, allowed, depth_m)
        np.testing.assert_array_equal(crept(inside, allowed, depth_m), expected)


def test_a_step_of_depth_is_a_border_and_a_slope_is_none() -> None:
    depth_m = np.full((30, 40), 2.0, dtype=np.float32) + 0.01 * np.arange(40, dtype=np.float32)
    depth_m[:, 30:] += 0.1
    inside = np.zeros((30, 40), dtype=bool)
    inside[15, 20] = True
    everything = np.ones((30, 40), dtype=bool)
    found = crept(inside, everything, depth_m)
    assert found[15, 20:30].all()
    assert not found[:, 30:].any()
