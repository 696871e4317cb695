"""Numba kernel that gives measured pixels the labels of network cells (one thread, no GIL)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def label_pixels(depth_m, cell, owner, label, cell_depth_m, bulge_m, slant, person_out, label_out):
    """Fill person and label (h,w) from a pixel's own cell or the four beside it.

    Args are measured depth (h,w) with NaN where missing, flat cells of pixels (h,w), and per cell
    (rows, columns) the person (-1: nobody), the label and the nearest depth. A pixel takes from
    the first cell whose surface it lies on: nearer than bulge_m + slant * depth.
    """
    rows, columns = owner.shape
    h, w = depth_m.shape
    for y in range(h):
        for x in range(w):
            z = depth_m[y, x]
            if np.isnan(z):
                continue
            row, column = cell[y, x] // columns, cell[y, x] % columns
            for dr, dc in ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0)):
                r = min(max(row + dr, 0), rows - 1)
                c = min(max(column + dc, 0), columns - 1)
                if owner[r, c] >= 0 and abs(z - cell_depth_m[r, c]) < bulge_m + slant * z:
                    person_out[y, x] = owner[r, c]
                    label_out[y, x] = label[r, c]
                    break
