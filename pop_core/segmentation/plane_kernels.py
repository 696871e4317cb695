"""Numba kernel of the floor: how many points lie on, and below, each of many planes."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True, error_model='numpy')
def plane_shares(points, width, normals, on_plane, below_widths, on, below):
    """Fill on (p) and below (p) with the shares of points there.

    Args:
        points: The cloud, a row per axis [m] (3, n).
        width: Half the width of a plane at each point [m] (n).
        normals: Unit normals of the planes (p, 3).
        on_plane: A point of each (p, 3).
        below_widths: How many widths under a plane a point is below it.
        on: Share of points within the width.
        below: Share of points farther down.
    """
    x, y, z = points
    n = len(x)
    for k in range(len(normals)):
        nx, ny, nz = normals[k]
        offset = nx * on_plane[k, 0] + ny * on_plane[k, 1] + nz * on_plane[k, 2]
        within, under = 0, 0
        for i in range(n):
            height = nx * x[i] + ny * y[i] + nz * z[i] - offset
            within += 1 if abs(height) < width[i] else 0
            under += 1 if height < -below_widths * width[i] else 0
        on[k], below[k] = within / n, under / n
