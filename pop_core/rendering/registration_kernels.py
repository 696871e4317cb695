"""Numba kernel of depth registration: a depth image as triangles."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def fill_faces(depth: np.ndarray, jump_ratio: float, faces: np.ndarray) -> int:
    """Fill two triangles per square of four near neighbours; return how many there are.

    A square with a NaN corner fails every comparison and carries no surface.
    """
    h, w = depth.shape
    count = 0
    for y in range(h - 1):
        for x in range(w - 1):
            a, b, c, d = depth[y, x], depth[y, x + 1], depth[y + 1, x], depth[y + 1, x + 1]
            nearest = min(min(a, b), min(c, d))
            limit = nearest * (1.0 + jump_ratio)
            if not (a <= limit and b <= limit and c <= limit and d <= limit):
                continue
            i = y * w + x
            faces[count, 0], faces[count, 1], faces[count, 2] = i, i + w, i + 1
            faces[count + 1, 0], faces[count + 1, 1], faces[count + 1, 2] = i + 1, i + w, i + w + 1
            count += 2
    return count
