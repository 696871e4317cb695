"""Numba kernel that gives measured pixels the labels of network cells (one thread, no GIL)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def label_pixels(
    depth_m, rays, box, lens, own, label, cell_depth_m, bulge_m, slant, person, person_out,
    label_out,
):
    """Fill person and label (h,w) from a pixel's own cell or the four beside it.

    Args are measured depth (h,w) with NaN where missing, (x/z, y/z) of pixels (h,w,2), the box of
    pixels to look at (left, top, right, bottom; inclusive), the focal length and the principal
    point in cells (3), and per cell (rows, columns) whether it shows the person, the label and
    the nearest depth. A pixel takes from the first cell whose surface it lies on: nearer than
    bulge_m + slant * depth. Pixels of somebody else stay theirs.
    """
    rows, columns = own.shape
    for y in range(box[1], box[3] + 1):
        for x in range(box[0], box[2] + 1):
            z = depth_m[y, x]
            if np.isnan(z) or person_out[y, x] >= 0:
                continue
            row = int(np.floor(rays[y, x, 1] * lens[0] + lens[2]))
            column = int(np.floor(rays[y, x, 0] * lens[0] + lens[1]))
            if row < 0 or column < 0 or row >= rows or column >= columns:
                continue
            for dr, dc in ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0)):
                r = min(max(row + dr, 0), rows - 1)
                c = min(max(column + dc, 0), columns - 1)
                if own[r, c] and abs(z - cell_depth_m[r, c]) < bulge_m + slant * z:
                    person_out[y, x] = person
                    label_out[y, x] = label[r, c]
                    break
