"""Numba kernels of PersonLab decoding (Papandreou et al. 2018, section 3.1 and 3.2)."""

from __future__ import annotations

import numpy as np
from numba import njit

N_KEYPOINTS = 17


@njit(cache=True, nogil=True)
def local_maxima(scores, threshold):
    """Return cells (n, 3) as (row, column, keypoint): 3x3 maxima of at least a threshold."""
    h, w, k = scores.shape
    found = np.empty((h * w * k, 3), dtype=np.int64)
    n = 0
    for y in range(h):
        for x in range(w):
            for j in range(k):
                value = scores[y, x, j]
                if value < threshold:
                    continue
                largest = True
                for yy in range(max(0, y - 1), min(h, y + 2)):
                    for xx in range(max(0, x - 1), min(w, x + 2)):
                        if scores[yy, xx, j] > value:
                            largest = False
                if largest:
                    found[n, 0], found[n, 1], found[n, 2] = y, x, j
                    n += 1
    return found[:n]


@njit(cache=True, nogil=True)
def refined(y, x, j, short, stride, steps):
    """Return a position [network px] moved by the short offsets of keypoint j, some times."""
    h, w = short.shape[:2]
    for _ in range(steps):
        row = min(h - 1, max(0, int(np.rint(y / stride))))
        column = min(w - 1, max(0, int(np.rint(x / stride))))
        y = row * stride + short[row, column, 0, j]
        x = column * stride + short[row, column, 1, j]
    return y, x


@njit(cache=True, nogil=True)
def grow_person(y, x, j, scores, short, mid, edges, stride, steps, out):
    """Fill out (17, 3) with (y, x, score), starting at keypoint j and following mid offsets.

    Mid offsets point from one end of an edge to the other, forward (0) and backward (1); each
    place is then refined by `steps` short offsets.
    """
    h, w = short.shape[:2]
    known = np.zeros(N_KEYPOINTS, dtype=np.bool_)
    row = min(h - 1, max(0, int(np.rint(y / stride))))
    column = min(w - 1, max(0, int(np.rint(x / stride))))
    out[j, 0], out[j, 1], out[j, 2] = y, x, scores[row, column, j]
    known[j] = True
    for _ in range(N_KEYPOINTS):
        for e in range(edges.shape[0]):
            a, b = edges[e]
            if known[a] == known[b]:
                continue
            source, target, way = (a, b, 0) if known[a] else (b, a, 1)
            row = min(h - 1, max(0, int(np.rint(out[source, 0] / stride))))
            column = min(w - 1, max(0, int(np.rint(out[source, 1] / stride))))
            ty = out[source, 0] + mid[row, column, way, 0, e]
            tx = out[source, 1] + mid[row, column, way, 1, e]
            ty, tx = refined(ty, tx, target, short, stride, steps)
            row = min(h - 1, max(0, int(np.rint(ty / stride))))
            column = min(w - 1, max(0, int(np.rint(tx / stride))))
            out[target, 0], out[target, 1] = ty, tx
            out[target, 2] = scores[row, column, target]
            known[target] = True
