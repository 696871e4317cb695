"""What bones cost against the depth image, beside the same in arrays."""

import numpy as np

from pop_core.fitting.limb_kernels import bone_misfits

SHAPE = (40, 50)
FOCAL_PX, CX, CY = 45.0, 25.0, 20.0
CLOTHES_M, LIMIT_M = 0.03, 0.15
FLOOR = np.array([0.0, -1.0, 0.0, 0.4])


def in_arrays(points, width, length, margin, measured, unexplained):
    z = points[..., 2]
    with np.errstate(divide='ignore', invalid='ignore'):
        u, v = (np.rint(FOCAL_PX * points[..., c] / z + centre)
                for c, centre in ((0, CX), (1, CY)))
    inside = (z > 0) & (u >= 0) & (v >= 0) & (u < SHAPE[1]) & (v < SHAPE[0])
    u, v = (np.where(inside, pixel, 0).astype(int) for pixel in (u, v))
    gap = np.where(inside, measured[v, u], np.nan) - z + width / 2
    known = np.isfinite(gap)
    gap = np.where(known, gap, 0.0)
    wrong = np.where(known, np.clip((gap - margin) / LIMIT_M, 0.0, 1.0), 0.0)
    below = -(points @ FLOOR[:3] + FLOOR[3])
    wrong = wrong + np.clip((below - 0.02) / LIMIT_M, 0.0, 1.0)
    met = np.clip(1.0 - np.abs(gap) / (margin + CLOTHES_M), 0.0, 1.0)
    right = np.where(known & unexplained[v, u], met, 0.0)
    area_px = length * width * (FOCAL_PX / np.maximum(z, 0.3)) ** 2
    return (area_px * (wrong - right)).sum(axis=1)


def test_the_kernel_is_the_sum_over_bones_in_arrays() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-1.5, -1.0, -0.2], [1.5, 1.0, 3.0], (200, 8, 3))
    width, length = rng.uniform(0.05, 0.15, (2, 8))
    margin = rng.uniform(0.03, 0.06, points.shape[:2])
    measured = rng.uniform(0.5, 3.0, SHAPE).astype(np.float32)
    measured[rng.random(SHAPE) < 0.2] = np.nan
    unexplained = rng.random(SHAPE) < 0.5
    found = bone_misfits(
        points, width, length, margin, measured, unexplained, FOCAL_PX, FOCAL_PX, CX, CY, FLOOR,
        CLOTHES_M, LIMIT_M)
    expected = in_arrays(points, width, length, margin, measured, unexplained)
    assert (expected > 0).any()
    assert (expected < 0).any()
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-4)
