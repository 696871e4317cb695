"""Pixels between two surfaces are found, by the kernel as by plain arrays."""

import numpy as np
import pytest

from pop_core.rgbd import flying_pixels

RATIO = 0.02


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
    assert not flying_pixels(depth_m).any()
    depth_m[:, 5] = 3.0
    expected = np.zeros((5, 9), dtype=bool)
    expected[:, 5] = True
    np.testing.assert_array_equal(flying_pixels(depth_m), expected)
    np.testing.assert_array_equal(flying_pixels(np.ascontiguousarray(depth_m.T)), expected.T)


@pytest.mark.parametrize('shape', [(1, 1), (1, 7), (7, 1), (2, 2), (40, 60)])
def test_the_kernel_agrees_with_plain_arrays(shape: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    depth_m = (2.0 + np.cumsum(rng.normal(scale=0.03, size=shape), axis=1)).astype(np.float32)
    depth_m[rng.random(shape) < 0.1] = np.nan
    np.testing.assert_array_equal(flying_pixels(depth_m), twin(depth_m))
    if shape == (40, 60):
        assert flying_pixels(depth_m).any()


def test_a_cut_out_of_an_image_is_read_as_it_lies() -> None:
    rng = np.random.default_rng(1)
    depth_m = rng.uniform(1.0, 4.0, (20, 30)).astype(np.float32)
    np.testing.assert_array_equal(flying_pixels(depth_m[::2, 3:]), twin(depth_m[::2, 3:]))
