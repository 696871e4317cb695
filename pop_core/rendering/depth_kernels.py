"""Numba kernels of meshes: z-buffer (float32 depth) and normals (one thread, no GIL)."""

from __future__ import annotations

import numpy as np
from numba import njit

NEAR_M = 0.05


@njit(cache=True, nogil=True)
def _seen(vertices, fx, fy, cx, cy):
    """Return pixels (u, v) and inverse depth of vertices; 0 is nearer than the near plane."""
    n = vertices.shape[0]
    u = np.empty(n)
    v = np.empty(n)
    inverse = np.empty(n)
    for i in range(n):
        z = vertices[i, 2]
        inverse[i] = 1.0 / z if z > NEAR_M else 0.0
        u[i] = fx * vertices[i, 0] * inverse[i] + cx
        v[i] = fy * vertices[i, 1] * inverse[i] + cy
    return u, v, inverse


@njit(cache=True, nogil=True)
def _draw(t, a, b, c, u, v, inverse, closed, depth, face_id):
    """Draw triangle t of vertices a, b, c; see `rasterize`."""
    h, w = depth.shape
    if inverse[a] == 0.0 or inverse[b] == 0.0 or inverse[c] == 0.0:
        return
    area = (u[b] - u[a]) * (v[c] - v[a]) - (u[c] - u[a]) * (v[b] - v[a])
    # v points down: what turns to the right in the image, faces away.
    if area == 0.0 or (closed and area > 0.0):
        return
    left = max(0, int(np.ceil(min(u[a], u[b], u[c]))))
    right = min(w - 1, int(np.floor(max(u[a], u[b], u[c]))))
    top = max(0, int(np.ceil(min(v[a], v[b], v[c]))))
    bottom = min(h - 1, int(np.floor(max(v[a], v[b], v[c]))))
    # Barycentric weights and inverse depth change by constants from pixel to pixel.
    share = 1.0 / area
    b_across, b_down = (v[c] - v[a]) * share, -(u[c] - u[a]) * share
    c_across, c_down = -(v[b] - v[a]) * share, (u[b] - u[a]) * share
    to_b, to_c = inverse[b] - inverse[a], inverse[c] - inverse[a]
    for y in range(top, bottom + 1):
        b_row, c_row = b_down * (y - v[a]), c_down * (y - v[a])
        for x in range(left, right + 1):
            wb = b_row + b_across * (x - u[a])
            wc = c_row + c_across * (x - u[a])
            if wb < 0.0 or wc < 0.0 or wb + wc > 1.0:
                continue
            z = 1.0 / (inverse[a] + wb * to_b + wc * to_c)
            if z < depth[y, x]:
                depth[y, x] = z
                face_id[y, x] = t


@njit(cache=True, nogil=True)
def rasterize(vertices, faces, fx, fy, cx, cy, closed, depth, face_id):
    """Draw triangles of the camera frame [m] into depth (h,w, +inf = nothing) and face ids.

    Pixel centres are integers. 1/z is linear over the image of a triangle, so depth is exact.
    Triangles that touch the near plane are left out, and those of a closed surface that face away.
    """
    u, v, inverse = _seen(vertices, fx, fy, cx, cy)
    for t in range(faces.shape[0]):
        _draw(t, faces[t, 0], faces[t, 1], faces[t, 2], u, v, inverse, closed, depth, face_id)


@njit(cache=True, nogil=True)
def rasterize_parts(vertices, faces, part, fx, fy, cx, cy, closed, depth):
    """Draw each part of a mesh into a depth image of its own (p,h,w, +inf = nothing)."""
    u, v, inverse = _seen(vertices, fx, fy, cx, cy)
    face_id = np.empty(depth.shape[1:], dtype=np.int32)
    for t in range(faces.shape[0]):
        _draw(t, faces[t, 0], faces[t, 1], faces[t, 2], u, v, inverse, closed, depth[part[t]],
              face_id)


@njit(cache=True, nogil=True)
def area_normals(vertices, faces, out):
    """Fill unit normals (n,3) of vertices, weighted by the area of their triangles."""
    out[:] = 0.0
    for t in range(faces.shape[0]):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        ux, uy, uz = (vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1],
                      vertices[b, 2] - vertices[a, 2])
        vx, vy, vz = (vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1],
                      vertices[c, 2] - vertices[a, 2])
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for i in (a, b, c):
            out[i, 0] += nx
            out[i, 1] += ny
            out[i, 2] += nz
    for i in range(out.shape[0]):
        length = np.sqrt(out[i, 0] ** 2 + out[i, 1] ** 2 + out[i, 2] ** 2)
        if length > 1e-12:
            out[i] /= length
