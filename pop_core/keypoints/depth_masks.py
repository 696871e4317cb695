"""Masks and body parts of people in the pixels of the measured image, from network cells."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float32, Int, Int8

from pop_core.keypoints.body_parts import LABEL_OF_CLASS
from pop_core.keypoints.canonical_depth import CanonicalView

# A pixel belongs to a cell's surface when its depth differs by no more than a limb's bulge, and a
# slant that grows with the distance of the two.
BULGE_M, SLANT = 0.06, 0.02
AROUND = ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0))


def label_pixels(
    depth_m: Float32[np.ndarray, 'h w'], view: CanonicalView,
    owner: Int[np.ndarray, 'rows columns'], part: Int[np.ndarray, 'rows columns'],
    cell_depth_m: Float32[np.ndarray, 'rows columns'],
) -> tuple[Int8[np.ndarray, 'h w'], Int8[np.ndarray, 'h w']]:
    """Return the person (-1: nobody) and the part's joint (-1: none) at each measured pixel.

    A pixel takes what its own cell or one beside it says, provided that it lies on the surface
    that the cell speaks of.

    Args:
        depth_m: Measured depth, NaN where missing.
        view: The network's view.
        owner: Person of each cell, -1 for nobody.
        part: Class of the body part of each cell.
        cell_depth_m: Nearest depth of each cell [m].
    """
    rows, columns = owner.shape
    stride = view.camera.width / columns
    person = np.full(depth_m.shape, -1, dtype=np.int8)
    label = np.full(depth_m.shape, -1, dtype=np.int8)
    near = _near_people(owner >= 0)
    row = np.clip((view.pixel_v / stride + 0.5 / stride).astype(np.int64), 0, rows - 1)
    column = np.clip((view.pixel_u / stride + 0.5 / stride).astype(np.int64), 0, columns - 1)
    v, u = np.nonzero(near[row, column] & np.isfinite(depth_m))
    row, column, z = row[v, u], column[v, u], depth_m[v, u]
    for dr, dc in AROUND:
        r, c = np.clip(row + dr, 0, rows - 1), np.clip(column + dc, 0, columns - 1)
        on_surface = np.abs(z - cell_depth_m[r, c]) < BULGE_M + SLANT * z
        taken = (person[v, u] < 0) & (owner[r, c] >= 0) & on_surface
        person[v[taken], u[taken]] = owner[r[taken], c[taken]]
        label[v[taken], u[taken]] = LABEL_OF_CLASS[part[r[taken], c[taken]]]
    return person, label


def _near_people(there: Bool[np.ndarray, 'rows columns']) -> Bool[np.ndarray, 'rows columns']:
    """Return cells that show a person or lie beside one that does."""
    padded = np.pad(there, 1)
    return (padded[1:-1, 1:-1] | padded[:-2, 1:-1] | padded[2:, 1:-1]
            | padded[1:-1, :-2] | padded[1:-1, 2:])
