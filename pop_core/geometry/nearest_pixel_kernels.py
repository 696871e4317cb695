"""Numba kernels that find the pixel of a mask nearest to another one, exactly.

The nearest of each column is known in two passes; a pixel then asks the columns beside it, until
they are farther off than what was found. Where few pixels ask, this takes a fraction of the time
of a distance transform of the whole image.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def nearest_rows(mask):
    """Return for every pixel the row of the pixel of a mask (h,w) nearest in its column, or -1."""
    h, w = mask.shape
    row = np.full((h, w), -1, dtype=np.int32)
    for y in range(h):
        for x in range(w):
            if mask[y, x]:
                row[y, x] = y
            elif y > 0:
                row[y, x] = row[y - 1, x]
    for y in range(h - 2, -1, -1):
        for x in range(w):
            below = row[y + 1, x]
            if below > y and (row[y, x] < 0 or below - y < y - row[y, x]):
                row[y, x] = below
    return row


@njit(cache=True, nogil=True)
def nearest_pixel(row, y, x, reach):
    """Return squared distance [px] and place (y, x) of the pixel of a mask nearest to a pixel.

    The place is (-1, -1) where there is none.

    Args:
        row: What `nearest_rows` returned.
        y: Row of the pixel.
        x: Column of it.
        reach: How far to look [px].
    """
    w = row.shape[1]
    best, best_y, best_x = reach * reach + 1.0, -1, -1
    aside = 0
    while aside * aside < best and aside < w:
        for column in (x - aside, x + aside):
            if 0 <= column < w and row[y, column] >= 0:
                d = aside * aside + (row[y, column] - y) ** 2
                if d < best:
                    best, best_y, best_x = float(d), row[y, column], column
        aside += 1
    return best, best_y, best_x
