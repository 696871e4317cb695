import numpy as np
import pytest
from scipy.spatial import cKDTree

from pop_core.fitting.nearest_kernels import nearest, shrunk


@pytest.mark.parametrize('spread', [0.01, 0.3, 40.0])
@pytest.mark.parametrize('away', [0.0, 5.0])
def test_the_nearest_is_that_of_a_tree(spread: float, away: float) -> None:
    rng = np.random.default_rng(0)
    places = rng.normal(size=(300, 3)) * spread
    points = rng.normal(size=(200, 3)) * 1.5 * spread + [away, -away, 0.0]
    index, distance = nearest(points, places)
    expected, _ = cKDTree(places).query(points)
    np.testing.assert_allclose(distance, expected, atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(points - places[index], axis=1), expected, atol=1e-12)


def test_of_one_place_it_is_the_nearest_to_everything() -> None:
    points = np.array([[0.0, 0.0, 0.0], [30.0, -20.0, 4.0]])
    index, distance = nearest(points, np.array([[1.0, 2.0, 2.0]]))
    assert index.tolist() == [0, 0]
    np.testing.assert_allclose(distance[0], 3.0)


def test_only_distances_along_rays_are_shrunk() -> None:
    rng = np.random.default_rng(1)
    ray = rng.normal(size=(20, 2))
    near, far = (np.column_stack([z * ray, np.full(20, z)]) for z in (2.0, 2.5))
    near, far = shrunk(near, 2.0, 0.25, 0.1), shrunk(far, 2.0, 0.25, 0.1)
    np.testing.assert_allclose(near[:, :2], 2.0 * ray, atol=1e-12)
    np.testing.assert_allclose(far - near, np.tile([0.0, 0.0, 0.125], (20, 1)), atol=1e-12)
    behind = shrunk(np.array([[1.0, 2.0, -3.0]]), 2.0, 0.25, 0.1)
    np.testing.assert_allclose(behind, [[20.0, 40.0, -0.75]])
