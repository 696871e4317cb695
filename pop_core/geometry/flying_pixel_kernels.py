"""Numba kernel of flying pixels (float32 depth [m], NaN = no measurement)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def flying(depth, jump_ratio, reach, out):
    """Mark pixels of depth (h, w) that lie between two surfaces, along a row or a column.

    Pixels `reach` to either side are compared: neighbours may repeat what was measured once.
    """
    h, w = depth.shape
    ratio = np.float32(jump_ratio)
    for y in range(h):
        for x in range(w):
            here = depth[y, x]
            low, high = here - here * ratio, here + here * ratio
            out[y, x] = False
            if reach <= x < w - reach:
                before, after = depth[y, x - reach], depth[y, x + reach]
                out[y, x] = (before < low and after > high) or (before > high and after < low)
            if reach <= y < h - reach and not out[y, x]:
                before, after = depth[y - reach, x], depth[y + reach, x]
                out[y, x] = (before < low and after > high) or (before > high and after < low)
