"""Numba kernel that reads measured depth into the pixels of a network's view (one thread)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def read_depth(depth_m, source_v, source_u, rows, columns, nearer_m, nearest_m, out):
    """Fill out (H,W) with the depth at source pixels of chosen rows and columns; 0 for none.

    Args are measured depth (h,w) with NaN where missing, its rows and columns per pixel of a grid
    (-1 outside), the grid's rows (H) and columns (W) to read (outside it there is nothing), what
    is subtracted [m] and the least depth that is shown [m]. Where a pixel is missing, the next
    one beside it is taken.
    """
    h, w = depth_m.shape
    high, wide = source_v.shape
    for i in range(len(rows)):
        for j in range(len(columns)):
            out[i, j] = 0.0
            r, c = rows[i], columns[j]
            if r < 0 or c < 0 or r >= high or c >= wide or source_v[r, c] < 0:
                continue
            for dv, du in ((0, 0), (0, 1), (1, 0), (0, -1), (-1, 0)):
                v = min(max(source_v[r, c] + dv, 0), h - 1)
                u = min(max(source_u[r, c] + du, 0), w - 1)
                z = depth_m[v, u]
                if np.isfinite(z) and z > 0:
                    out[i, j] = z - nearer_m if z - nearer_m >= nearest_m else 0.0
                    break
