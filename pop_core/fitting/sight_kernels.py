"""Numba kernels that compare a body, its vertices or its image, with the measured depth."""

from __future__ import annotations

import numpy as np
from numba import njit

VISIBLE, SELF_OCCLUDED, SCENE_OCCLUDED, OUT_OF_IMAGE, UNKNOWN, CONTRADICTED = range(6)


@njit(cache=True, nogil=True)
def see(
    vertices, normals, margin, fx, fy, cx, cy, measured, own, rendered, self_tolerance, sight, gap,
):
    """Fill sight (n, of `Sight`) and gap (n, measured minus vertex depth [m]).

    measured, own and rendered (h, w) are depth [m], whether a pixel may show the person, and the
    depth of the body alone [m]; margin (n) is how far in front of the measured surface a vertex
    may lie [m].
    """
    h, w = measured.shape
    for i in range(vertices.shape[0]):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        gap[i] = np.inf
        sight[i] = OUT_OF_IMAGE
        if not z > 0.0:
            continue
        column, row = np.rint(fx * x / z + cx), np.rint(fy * y / z + cy)
        if not (0 <= column < w and 0 <= row < h):
            continue
        u, v = int(column), int(row)
        gap[i] = np.float64(measured[v, u]) - z
        if np.isinf(gap[i]):
            continue
        toward = normals[i, 0] * x + normals[i, 1] * y + normals[i, 2] * z < 0.0
        if not toward or rendered[v, u] < z - self_tolerance:
            sight[i] = SELF_OCCLUDED
        elif np.isnan(gap[i]):
            sight[i] = UNKNOWN
        # Another person's pixel hides what lies behind it, however close.
        elif gap[i] < -3.0 * margin[i] or (not own[v, u] and gap[i] < margin[i]):
            sight[i] = SCENE_OCCLUDED
        elif gap[i] > margin[i]:
            sight[i] = CONTRADICTED
        else:
            sight[i] = VISIBLE


@njit(cache=True, nogil=True)
def mean_misfit(body, measured, segment, limit):
    """Return E_depth [m] of a body (see `depth_energy`): the error of pixels per segment pixel."""
    total, count = 0.0, 0
    h, w = measured.shape
    for y in range(h):
        for x in range(w):
            count += segment[y, x]
            if body[y, x] == np.inf and not segment[y, x]:
                continue  # most of an image
            depth = measured[y, x]
            if np.isnan(depth):
                continue  # what was not measured can hide anything, so it costs nothing
            if segment[y, x]:
                total += min(abs(body[y, x] - depth), limit)
            elif body[y, x] < depth:
                total += min(depth - body[y, x], limit)
    return total / max(count, 1)
