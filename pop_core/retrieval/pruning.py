"""Thinning of poses to a set whose members keep a distance: k-centres at a given spacing.

The distance of two poses is the mean over the shared joints [m], both upright and centred at the
pelvis. A joint-wise unit projection changes no more than that distance, so poses that are near
share cells of a grid over a few projections, and only neighbours need be compared.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.retrieval import pruning_kernels as kernels

AXES = 4  # of the grid
KEYS = 12  # projections compared before joints are
CELLS = 40  # along each axis; poses beyond the ends share the last cell


class PoseThinner:
    """Accepts poses one batch after the other, each at least `spacing_m` from all accepted."""

    def __init__(
        self, sample: Float32[np.ndarray, 'n s 3'], spacing_m: float, wanted: int
    ) -> None:
        """Prepare the grid.

        Args:
            sample: Joints [m] of typical poses; they only decide the grid's axes.
            spacing_m: Smallest distance of two accepted poses [m].
            wanted: Most poses to accept.
        """
        self.spacing_m, self.wanted, self.count = spacing_m, wanted, 0
        self._axes = _unit_axes(sample)
        middle = np.median(self._project(sample)[:, :AXES], axis=0)
        self._low = middle - 0.5 * CELLS * spacing_m
        self._shape = np.full(AXES, CELLS)
        self._heads = np.full(CELLS**AXES, -1, dtype=np.int32)
        self._links = np.full(wanted, -1, dtype=np.int32)
        self._accepted = np.empty((wanted, *sample.shape[1:]), dtype=np.float32)
        self._accepted_keys = np.empty((wanted, self._axes.shape[1]), dtype=np.float32)

    @property
    def full(self) -> bool:
        """Return whether as many poses as wanted were accepted."""
        return self.count >= self.wanted

    def accept(self, joints: Float32[np.ndarray, 'n s 3']) -> Int[np.ndarray, 'k']:
        """Return the rows of a batch that are accepted, in order."""
        keys = self._project(joints)
        cells = np.floor((keys[:, :AXES] - self._low) / self.spacing_m).astype(np.int64)
        kept = np.empty(len(joints), dtype=np.int64)
        before = self.count
        self.count = int(kernels.keep_apart(
            joints, keys, np.clip(cells, 0, CELLS - 1), self._shape, self._heads, self._links,
            self._accepted, self._accepted_keys, before, self.spacing_m, self.wanted, kept))
        return kept[: self.count - before]

    def _project(self, joints: Float32[np.ndarray, 'n s 3']) -> Float32[np.ndarray, 'n d']:
        return np.asarray(joints.reshape(len(joints), -1) @ self._axes)


def nearest_distances(
    queries: Float32[np.ndarray, 'n s 3'], joints: Float32[np.ndarray, 'm s 3']
) -> Float[np.ndarray, 'n']:
    """Return each query's distance to the nearest pose: the mean over joints [m]."""
    out = np.empty(len(queries))
    kernels.nearest_distance(queries, np.ascontiguousarray(joints), out)
    return out


def _unit_axes(sample: Float32[np.ndarray, 'n s 3']) -> Float32[np.ndarray, 'x d']:
    """Return projections along which no two poses lie farther apart than their distance."""
    n, s, _ = sample.shape
    flat = sample.reshape(n, -1).astype(np.float64)
    _, _, directions = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    per_joint = directions[:KEYS].reshape(-1, s, 3)
    length = np.linalg.norm(per_joint, axis=2, keepdims=True)
    unit = per_joint / np.maximum(length, 1e-9) / s
    return np.ascontiguousarray(unit.reshape(len(unit), -1).T.astype(np.float32))
