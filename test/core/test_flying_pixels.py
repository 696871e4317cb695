"""Pixels between two surfaces are found, by the kernel as by plain arrays."""

import numpy as np
import pytest

from pop_core.rgbd import flying_pixels

RATIO = 0.02
FOCAL_PX = 525.0


def twin(depth_m: np.ndarray) -> np.ndarray:
    """The same in plain arrays."""
    padded = np.pad(depth_m, 1, mode='edge')
    jump = depth_m * np.float32(RATIO)
    out = np.zeros(depth_m.shape, dtype=bool)
    for before, after in (
        (padded[1:-1, :-2], padded[1:-1, 2:]), (padded[:-2, 1:-1], padded[2:, 1:-1]),
    ):
        out |= (before < depth_m - jump) & (after > depth_m + jump)
        out |= (before > depth_m + jump) & (after < depth_m - jump)
    return out


def test_a_pixel_between_two_surfaces_flies_and_an_edge_does_not() -> None:
    depth_m = np.full((5, 9), 2.0, dtype=np.float32)
    depth_m[:, 5:] = 4.0
    assert not flying_pixels(depth_m, FOCAL_PX).any()
    depth_m[:, 5] = 3.0
    expected = np.zeros((5, 9), dtype=bool)
    expected[:, 5] = True
    np.testing.assert_array_equal(flying_pixels(depth_m, FOCAL_PX), expected)
    turned = flying_pixels(np.ascontiguousarray(depth_m.T), FOCAL_PX)
    np.testing.assert_array_equal(turned, expected.T)


@pytest.mark.parametrize('shape', [(1, 1), (1, 7), (7, 1), (2, 2), (40, 60)])
def test_the_kernel_agrees_with_plain_arrays(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    depth_m = (2.0 + np.cumsum(rng.normal(scale=0.03, size=shape), axis=1)).astype(np.float32)
    depth_m[rng.random(shape) < 0.1] = np.nan
    np.testing.assert_array_equal(flying_pixels(depth_m, FOCAL_PX), twin(depth_m))
    if shape == (40, 60):
        assert flying_pixels(depth_m, FOCAL_PX).any()


def test_a_cut_out_of_an_image_is_read_as_it_lies() -> None:
    rng = np.random.default_rng(1)
    depth_m = rng.uniform(1.0, 4.0, (20, 30)).astype(np.float32)
    cut = depth_m[::2, 3:]
    np.testing.assert_array_equal(flying_pixels(cut, FOCAL_PX), twin(cut))


@pytest.mark.parametrize('finer', [2, 3])
def test_depth_that_repeats_its_pixels_flies_as_what_was_measured(finer: int) -> None:
    rng = np.random.default_rng(2)
    measured_m = np.where(np.arange(60) < 30, 2.0, 3.5).astype(np.float32) * np.ones((40, 1))
    measured_m[:, 30] = rng.uniform(2.2, 3.3, 40)
    measured_m = measured_m.astype(np.float32)
    aligned_m = np.kron(measured_m, np.ones((finer, finer), dtype=np.float32))
    flying = flying_pixels(measured_m, FOCAL_PX)
    assert flying.sum() == 40
    shown = flying_pixels(aligned_m, finer * FOCAL_PX)
    assert shown[np.kron(flying, np.ones((finer, finer), dtype=bool))].all()
    assert not flying_pixels(aligned_m, FOCAL_PX).any()  # the test would be empty otherwise
