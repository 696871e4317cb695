"""Numba kernels of E_free: where vertices go that the sensor saw through."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.fitting.robust_kernels import geman_mcclure
from pop_core.fitting.sight_kernels import CONTRADICTED
from pop_core.geometry.nearest_pixel_kernels import nearest_pixel

STEP = 2  # of the power of the robust share


@njit(cache=True, nogil=True)
def gaps_along_rays(vertices, sight, gap, small_gap, weight):
    """Return (vertex, direction, target, weight) of small gaps, and the vertices of large ones."""
    n = vertices.shape[0]
    small, large = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    smalls, larges = 0, 0
    for i in range(n):
        if sight[i] == CONTRADICTED and gap[i] <= small_gap:
            small[smalls] = i
            smalls += 1
        elif sight[i] == CONTRADICTED:
            large[larges] = i
            larges += 1
    direction, target = np.empty((smalls, 3)), np.empty((smalls, 3))
    for k in range(smalls):
        i = small[k]
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        length = np.sqrt(x * x + y * y + z * z)
        for c in range(3):
            direction[k, c] = vertices[i, c] / length
            target[k, c] = vertices[i, c] * (1.0 + gap[i] / z)
    return (small[:smalls], direction, target, np.full(smalls, weight)), large[:larges]


@njit(cache=True, nogil=True)
def hiding_slices(z, slices):
    """Return the last of rising slices [m] that begins before each depth [m], else the first.

    The slice before a point's depth is the cautious one: what hides there, hides it.
    """
    out = np.empty(z.shape[0], dtype=np.int64)
    for i in range(z.shape[0]):
        k = 0
        while k + 1 < slices.shape[0] and slices[k + 1] <= z[i]:
            k += 1
        out[i] = k
    return out


@njit(cache=True, nogil=True)
def hidden_places(row, points, chosen, fx, fy, cx, cy, rays, out):
    """Fill the nearest hidden place (n,3) [m] of chosen points at their depth, where there is one.

    Args:
        row: What `nearest_rows` returned of the places that hide, every other pixel: a pull
            sideways need not know its end to the pixel.
        points: (n,3) camera frame [m].
        chosen: (n) which points ask.
        fx: Focal length across [px].
        fy: The same down.
        cx: Column of the principal point [px].
        cy: Row of it.
        rays: (h,w,2) x/z and y/z of every pixel.
        out: (n,3), left alone where nothing hides.
    """
    h, w = rays.shape[:2]
    farthest = float(row.shape[0] + row.shape[1])
    for i in range(points.shape[0]):
        if not chosen[i]:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        # By rounding, half a pixel may be another.
        u = min(max(int(np.rint(fx * x / z + cx)), 0), w - 1)
        v = min(max(int(np.rint(fy * y / z + cy)), 0), h - 1)
        _, at_v, at_u = nearest_pixel(row, v // 2, u // 2, farthest)
        if at_v >= 0:
            out[i, 0] = rays[2 * at_v, 2 * at_u, 0] * z
            out[i, 1] = rays[2 * at_v, 2 * at_u, 1] * z
            out[i, 2] = z


@njit(cache=True, nogil=True)
def pulls_aside(vertices, vertex, target, weight, scale):
    """Return (vertex, direction, target, weight) of robust pulls along x and y."""
    n = vertex.shape[0]
    direction, strength = np.zeros((2 * n, 3)), np.empty(2 * n)
    for i in range(n):
        square = 0.0
        for c in range(3):
            square += (vertices[vertex[i], c] - target[i, c]) ** 2
        direction[i, 0] = direction[n + i, 1] = 1.0
        strength[i] = strength[n + i] = weight * geman_mcclure(square, scale, STEP)
    return (
        np.concatenate((vertex, vertex)), direction, np.concatenate((target, target)), strength)
