import numpy as np
import pytest

from pop_core.geometry.nearest_pixel_kernels import nearest_pixel, nearest_rows

SHAPE = (30, 40)


@pytest.mark.parametrize('share', [0.01, 0.05, 0.7])
def test_the_nearest_pixel_is_that_of_a_search_through_all(share: float) -> None:
    rng = np.random.default_rng(1)
    mask = rng.random(SHAPE) < share
    v, u = np.nonzero(mask)
    uv = rng.integers(0, [SHAPE[1], SHAPE[0]], (100, 2))
    squared = (u - uv[:, :1]) ** 2 + (v - uv[:, 1:]) ** 2
    row = nearest_rows(mask)
    found = np.array([nearest_pixel(row, y, x, 70.0) for x, y in uv]).astype(int)
    assert mask[found[:, 1], found[:, 2]].all()
    np.testing.assert_array_equal(found[:, 0], squared.min(axis=1))
    np.testing.assert_array_equal(
        np.square(found[:, :0:-1] - uv).sum(axis=1), squared.min(axis=1))


def test_nothing_is_nearest_in_an_empty_mask() -> None:
    row = nearest_rows(np.zeros(SHAPE, dtype=bool))
    assert nearest_pixel(row, 4, 3, 70.0)[1:] == (-1, -1)


def test_what_is_out_of_reach_is_not_found() -> None:
    mask = np.zeros(SHAPE, dtype=bool)
    mask[10, 10] = True
    row = nearest_rows(mask)
    assert nearest_pixel(row, 10, 14, 4.0) == (16.0, 10, 10)
    assert nearest_pixel(row, 10, 15, 4.0)[1:] == (-1, -1)
