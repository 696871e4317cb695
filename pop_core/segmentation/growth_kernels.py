"""Numba kernel of the connected growth of a segment over depth."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def grow(segment, allowed, depth_m, gamma_m):
    """Grow `segment` in place over `allowed` pixels whose depth is within gamma of a neighbour."""
    h, w = segment.shape
    queue = np.empty((h * w, 2), dtype=np.int32)
    tail = 0
    for y in range(h):
        for x in range(w):
            if segment[y, x]:
                queue[tail, 0], queue[tail, 1] = y, x
                tail += 1
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        for k in range(4):
            ny = y + (1 if k == 0 else -1 if k == 1 else 0)
            nx = x + (1 if k == 2 else -1 if k == 3 else 0)
            if ny < 0 or nx < 0 or ny >= h or nx >= w or segment[ny, nx]:
                continue
            if allowed[ny, nx] and abs(depth_m[ny, nx] - depth_m[y, x]) < gamma_m:
                segment[ny, nx] = True
                queue[tail, 0], queue[tail, 1] = ny, nx
                tail += 1
