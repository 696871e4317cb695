"""Numba kernels of capsules (see capsules.py for their meaning)."""

from __future__ import annotations

import numpy as np
from numba import njit

TINY = 1e-12
APART_M = 1e-9


@njit(cache=True, nogil=True)
def closest_shares(ends, pairs):
    """Return where pairs of segments are nearest (p,2), as shares of their lengths, and how near.

    ends (2,n,3) holds both ends of every segment, pairs (p,2) indices of segments. Clamping the
    nearest points of two lines to their segments (Ericson 2004, section 5.1.9).
    """
    shares = np.empty((pairs.shape[0], 2))
    distance = np.empty(pairs.shape[0])
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        uu, uv, vv, uw, vw, ww = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            u = ends[1, i, c] - ends[0, i, c]
            v = ends[1, j, c] - ends[0, j, c]
            w = ends[0, i, c] - ends[0, j, c]
            uu += u * u
            uv += u * v
            vv += v * v
            uw += u * w
            vw += v * w
            ww += w * w
        s, t = 0.0, 0.0
        across = uu * vv - uv * uv
        if across > TINY:  # parallel ones are equally near in many places
            s = min(max((uv * vw - vv * uw) / across, 0.0), 1.0)
        if vv > TINY:
            t = min(max((uv * s + vw) / vv, 0.0), 1.0)
        if uu > TINY:
            s = min(max((uv * t - uw) / uu, 0.0), 1.0)
        square = (
            ww + s * s * uu + t * t * vv + 2.0 * (s * uw - t * vw - s * t * uv))
        shares[k, 0], shares[k, 1] = s, t
        distance[k] = np.sqrt(max(square, 0.0))
    return shares, distance


@njit(cache=True, nogil=True)
def overlaps(ends, radius, pairs):
    """Return (pair, share, depth, away) of the pairs of capsules that overlap.

    ends (2,n,3) of their axes [m], radius (n) [m], pairs (p,2). Share (m,2) is where the nearest
    points lie along the axes, depth (m) the sum of radii minus their distance [m], away (m,3) the
    direction from the second axis to the first. Axes that cross have none, and one step moves them
    off each other.
    """
    every, distance = closest_shares(ends, pairs)
    rows = np.empty(pairs.shape[0], dtype=np.int64)
    count = 0
    for k in range(pairs.shape[0]):
        if radius[pairs[k, 0]] + radius[pairs[k, 1]] > distance[k]:
            rows[count] = k
            count += 1
    depth, away = np.empty(count), np.empty((count, 3))
    for m in range(count):
        k = rows[m]
        i, j = pairs[k, 0], pairs[k, 1]
        s, t = every[k, 0], every[k, 1]
        depth[m] = radius[i] + radius[j] - distance[k]
        for c in range(3):
            of_first = ends[0, i, c] + s * (ends[1, i, c] - ends[0, i, c])
            of_second = ends[0, j, c] + t * (ends[1, j, c] - ends[0, j, c])
            away[m, c] = (of_first - of_second) / max(distance[k], APART_M)
    return pairs[rows[:count]], every[rows[:count]], depth, away
