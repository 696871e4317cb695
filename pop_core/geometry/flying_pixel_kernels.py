"""Numba kernel of flying pixels (float32 depth [m], NaN = no measurement)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def flying(depth, jump_ratio, out):
    """Mark pixels of depth (h, w) that lie between two surfaces, along a row or a column."""
    h, w = depth.shape
    ratio = np.float32(jump_ratio)
    for y in range(h):
        for x in range(w):
            here = depth[y, x]
            low, high = here - here * ratio, here + here * ratio
            out[y, x] = False
            if 0 < x < w - 1:
                before, after = depth[y, x - 1], depth[y, x + 1]
                out[y, x] = (before < low and after > high) or (before > high and after < low)
            if 0 < y < h - 1 and not out[y, x]:
                before, after = depth[y - 1, x], depth[y + 1, x]
                out[y, x] = (before < low and after > high) or (before > high and after < low)
