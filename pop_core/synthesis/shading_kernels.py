"""Numba interpolation of vertex attributes over a rendered image."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def interpolate(points, face, vertices, faces, attributes, out):
    """Fill out (h,w,c) with attributes (n,c) at the surface points (h,w,3) of visible faces.

    Barycentric coordinates come from areas in the triangle's own plane; pixels without a face
    are left as they are.
    """
    h, w = face.shape
    channels = attributes.shape[1]
    for y in range(h):
        for x in range(w):
            t = face[y, x]
            if t < 0:
                continue
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
            bx, by, bz = vertices[b, 0] - ax, vertices[b, 1] - ay, vertices[b, 2] - az
            cx, cy, cz = vertices[c, 0] - ax, vertices[c, 1] - ay, vertices[c, 2] - az
            dx, dy, dz = points[y, x, 0] - ax, points[y, x, 1] - ay, points[y, x, 2] - az
            s11 = bx * bx + by * by + bz * bz
            s12 = bx * cx + by * cy + bz * cz
            s22 = cx * cx + cy * cy + cz * cz
            t1 = dx * bx + dy * by + dz * bz
            t2 = dx * cx + dy * cy + dz * cz
            determinant = s11 * s22 - s12 * s12
            if determinant <= 0.0:
                wb, wc = 0.0, 0.0
            else:
                wb = min(1.0, max(0.0, (s22 * t1 - s12 * t2) / determinant))
                wc = min(1.0 - wb, max(0.0, (s11 * t2 - s12 * t1) / determinant))
            wa = 1.0 - wb - wc
            for k in range(channels):
                out[y, x, k] = (
                    wa * attributes[a, k] + wb * attributes[b, k] + wc * attributes[c, k])
