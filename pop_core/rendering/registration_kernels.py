"""Numba kernel of depth registration: a depth image drawn as a surface into another camera."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.rendering.depth_kernels import NEAR_M, draw_triangle, invert_depth


@njit(cache=True, nogil=True)
def _project_row(depth, rays, offset, fx, fy, cx, cy, u, v, inverse):
    """Fill pixels (u, v) and inverse depth of a row of points; 0 for none, or too near."""
    for x in range(depth.shape[0]):
        z = rays[x, 2] * depth[x] + offset[2]
        inverse[x] = 1.0 / z if z > NEAR_M else 0.0
        u[x] = fx * (rays[x, 0] * depth[x] + offset[0]) * inverse[x] + cx
        v[x] = fy * (rays[x, 1] * depth[x] + offset[1]) * inverse[x] + cy


@njit(cache=True, nogil=True)
def draw_measured_surface(
    depth, rays, offset, jump_ratio, fx, fy, cx, cy, drawn, face_id
):
    """Draw two triangles per square of four near neighbours into depth (H,W, zeros; +inf = none).

    A square with a NaN corner fails every comparison and carries no surface. Points are
    `rays` (h,w,3) times depth plus `offset`; two rows of them are kept at a time.
    """
    h, w = depth.shape
    u, v, inverse = np.empty(2 * w), np.empty(2 * w), np.empty(2 * w)
    _project_row(depth[0], rays[0], offset, fx, fy, cx, cy, u[:w], v[:w], inverse[:w])
    for y in range(h - 1):
        upper, lower = (y % 2) * w, ((y + 1) % 2) * w
        below = slice(lower, lower + w)
        _project_row(depth[y + 1], rays[y + 1], offset, fx, fy, cx, cy, u[below], v[below],
                     inverse[below])
        for x in range(w - 1):
            a, b, c, d = depth[y, x], depth[y, x + 1], depth[y + 1, x], depth[y + 1, x + 1]
            nearest = min(min(a, b), min(c, d))
            limit = nearest * (1.0 + jump_ratio)
            if not (a <= limit and b <= limit and c <= limit and d <= limit):
                continue
            i, j = upper + x, lower + x
            draw_triangle(0, i, j, i + 1, u, v, inverse, False, drawn, face_id)
            draw_triangle(0, i + 1, j, j + 1, u, v, inverse, False, drawn, face_id)
    invert_depth(drawn)
