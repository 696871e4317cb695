"""Which cells show the same person: those whose votes for a trunk gather in one place.

Two people cannot have their trunks in one place, however much they overlap in the image.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from pop_core.keypoints.depth_votes import TRUNK, Cells, DepthNetConfig

BANDWIDTH_M = 0.12
SHIFTS = 4
MOST_CELLS = 350  # of a trunk's search; more are thinned out


def group_cells(cells: Cells, config: DepthNetConfig) -> Int[np.ndarray, 'n']:
    """Return the person of each cell, the largest first; -1 for cells that belong to nobody.

    Args:
        cells: Cells that show people.
        config: Settings.
    """
    mass = cells.probability * cells.area_m2
    centres = _modes(voted_trunks(cells), mass, config.trunk_gap_m)
    if len(centres) == 0:
        return np.full(len(cells), -1, dtype=np.int64)
    owner = nearest_trunk(cells, centres, config.reach_m)
    total = np.array([mass[owner == k].sum() for k in range(len(centres))])
    order = np.argsort(-total, kind='stable')
    rank = np.full(len(centres) + 1, -1)
    kept = order[total[order] >= config.min_area_m2]
    rank[kept] = np.arange(len(kept))
    return rank[owner]


def nearest_trunk(
    cells: Cells, trunks: Float[np.ndarray, 'k 3'], reach_m: float
) -> Int[np.ndarray, 'n']:
    """Return the trunk that each cell places its own nearest to; -1 beyond reach of all.

    Args:
        cells: Cells that show people.
        trunks: Middles of trunks [m].
        reach_m: Farthest that a cell may place its own from it.
    """
    distance = np.linalg.norm(voted_trunks(cells)[:, None] - trunks[None], axis=2)
    return np.where(distance.min(axis=1) < reach_m, distance.argmin(axis=1), -1)


def voted_trunks(cells: Cells) -> Float[np.ndarray, 'n 3']:
    """Return where each cell sees the middle of the trunk [m]."""
    weight = 1.0 / cells.sigma_m[:, TRUNK] ** 2
    points = (cells.joints[:, TRUNK] * weight[..., None]).sum(axis=1)
    return np.asarray(points / weight.sum(axis=1, keepdims=True))


def _modes(
    points: Float[np.ndarray, 'n 3'], mass: Float[np.ndarray, 'n'], gap_m: float
) -> Float[np.ndarray, 'k 3']:
    """Return the places where mass gathers, most first, at least a gap apart (mean shift)."""
    step = -(-len(points) // MOST_CELLS)
    some, their_mass = points[::max(step, 1)], mass[::max(step, 1)]
    free = np.ones(len(some), dtype=bool)
    modes: list[Float[np.ndarray, '3']] = []
    density = _kernel(some, some) @ their_mass
    while free.any():
        start = int(np.argmax(np.where(free, density, -1.0)))
        centre = some[start]
        for _ in range(SHIFTS):
            weight = _kernel(centre[None], some)[0] * their_mass
            centre = weight @ some / weight.sum()
        free &= np.linalg.norm(some - centre, axis=1) > gap_m
        free[start] = False
        if all(np.linalg.norm(centre - mode) >= gap_m for mode in modes):
            modes.append(centre)
    return np.array(modes).reshape(-1, 3)


def _kernel(a: Float[np.ndarray, 'm 3'], b: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'm n']:
    squared = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.exp(-np.maximum(squared, 0.0) / (2 * BANDWIDTH_M**2))
