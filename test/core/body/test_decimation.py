import numpy as np
import pytest

from pop_core.body.body_facts import mesh_facts
from pop_core.body.decimation import decimate

Thinned = tuple[np.ndarray, np.ndarray, np.ndarray]  # fine points, kept ones, faces


def _sphere(rings: int, sectors: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed unit sphere, poles at +-z, faces outward."""
    polar = np.linspace(0, np.pi, rings + 2)[1:-1, None]
    around = np.arange(sectors)[None] * 2 * np.pi / sectors
    ring = np.stack(np.broadcast_arrays(
        np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)), axis=-1)
    points = np.concatenate([[[0, 0, 1.0]], ring.reshape(-1, 3), [[0, 0, -1.0]]])
    here = 1 + np.arange(sectors)
    after = 1 + (np.arange(sectors) + 1) % sectors
    faces = [np.stack([np.zeros_like(here), here, after], axis=1)]
    for row in range(rings - 1):
        a, b = here + row * sectors, after + row * sectors
        faces += [np.stack([a, a + sectors, b], 1), np.stack([b, a + sectors, b + sectors], 1)]
    last = (rings - 1) * sectors
    south = np.full_like(here, len(points) - 1)
    return points, np.concatenate([*faces, np.stack([south, after + last, here + last], axis=1)])


def _grid(side: int) -> tuple[np.ndarray, np.ndarray]:
    """A flat square with a border."""
    y, x = np.mgrid[:side, :side]
    points = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1).astype(float)
    a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate([
        np.stack([a, a + 1, a + side], axis=1), np.stack([a + 1, a + side + 1, a + side], axis=1)])
    return points, faces


@pytest.fixture(scope='module')
def thinned_sphere() -> Thinned:
    points, faces = _sphere(30, 40)
    kept, thin = decimate(points, faces, 300)
    return points, kept, thin


def test_the_wanted_number_of_vertices_is_left(thinned_sphere: Thinned) -> None:
    _, kept, thin = thinned_sphere
    assert len(kept) == 300
    assert set(thin.ravel().tolist()) == set(range(300))


def test_a_closed_surface_stays_closed_and_a_sphere(thinned_sphere: Thinned) -> None:
    points, kept, thin = thinned_sphere
    facts = mesh_facts(points[kept], thin)
    edges = 3 * len(thin) // 2
    assert facts.closed
    assert len(kept) - edges + len(thin) == 2  # Euler's formula: no handle, no hole


def test_faces_still_look_outward_and_none_is_degenerate(thinned_sphere: Thinned) -> None:
    points, kept, thin = thinned_sphere
    a, b, c = (points[kept][thin[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    assert ((a + b + c) * normal).sum(1).min() > 0
    assert np.linalg.norm(normal, axis=1).min() > 1e-4


def test_no_two_faces_share_all_their_vertices(thinned_sphere: Thinned) -> None:
    _, _, thin = thinned_sphere
    assert len(np.unique(np.sort(thin, axis=1), axis=0)) == len(thin)


def test_the_surface_hardly_moves(thinned_sphere: Thinned) -> None:
    points, kept, thin = thinned_sphere
    # A chord of 0.25, the mean spacing of 300 points on the sphere, sags by 0.25^2 / 8 = 0.008.
    centre = points[kept][thin].mean(axis=1)
    assert np.linalg.norm(centre, axis=1).min() > 0.95


def test_vertices_stay_evenly_spread(thinned_sphere: Thinned) -> None:
    points, kept, thin = thinned_sphere
    # The fine sphere itself, crowded at its poles, has 0.32.
    assert mesh_facts(points[kept], thin).edge_spread < 0.32


def test_a_border_keeps_its_place() -> None:
    points, faces = _grid(15)
    kept, thin = decimate(points, faces, 60)
    a, b, c = (points[kept][thin[:, corner]] for corner in range(3))
    area = np.cross(b - a, c - a)[:, 2] / 2
    assert area.min() > 0
    assert area.sum() == pytest.approx(14 * 14)


def test_a_tetrahedron_cannot_be_thinned() -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    kept, thin = decimate(points, faces, 3)
    assert len(kept) == 4
    assert len(thin) == 4
