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


@njit(cache=True, nogil=True, inline='always')  # a call with six arrays costs as much as it draws
def draw_triangle(t, a, b, c, u, v, inverse, closed, nearest, face_id):
    """Draw triangle t of vertices a, b, c into inverse depth, 0 = nothing; see `rasterize`."""
    h, w = nearest.shape
    if inverse[a] == 0.0 or inverse[b] == 0.0 or inverse[c] == 0.0:
        return
    ab_u, ab_v, ac_u, ac_v = u[b] - u[a], v[b] - v[a], u[c] - u[a], v[c] - v[a]
    area = ab_u * ac_v - ac_u * ab_v
    # v points down: what turns to the right in the image, faces away.
    if area == 0.0 or (closed and area > 0.0):
        return
    left = max(0, int(np.ceil(min(u[a], u[b], u[c]))))
    right = min(w - 1, int(np.floor(max(u[a], u[b], u[c]))))
    top = max(0, int(np.ceil(min(v[a], v[b], v[c]))))
    bottom = min(h - 1, int(np.floor(max(v[a], v[b], v[c]))))
    if left > right or top > bottom:
        return
    # Barycentric weights and inverse depth change by constants from pixel to pixel.
    share = 1.0 / area
    b_across, b_down, c_across, c_down = ac_v * share, -ac_u * share, -ab_v * share, ab_u * share
    to_b, to_c = inverse[b] - inverse[a], inverse[c] - inverse[a]
    across = b_across * to_b + c_across * to_c
    for y in range(top, bottom + 1):
        right_of_a, below_a = left - u[a], y - v[a]
        b_left = b_down * below_a + b_across * right_of_a
        c_left = c_down * below_a + c_across * right_of_a
        at_left = inverse[a] + b_left * to_b + c_left * to_c
        for x in range(left, right + 1):
            wb, wc = b_left + b_across * (x - left), c_left + c_across * (x - left)
            if wb < 0.0 or wc < 0.0 or wb + wc > 1.0:
                continue
            near = np.float32(at_left + across * (x - left))
            if near > nearest[y, x]:
                nearest[y, x] = near
                face_id[y, x] = t


@njit(cache=True, nogil=True, error_model='numpy')
def invert_depth(image):
    """Turn inverse depth (h,w) into depth: what is 0 becomes +inf."""
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            image[y, x] = np.float32(1.0) / image[y, x]


@njit(cache=True, nogil=True)
def rasterize(vertices, faces, fx, fy, cx, cy, closed, depth, face_id):
    """Draw triangles of the camera frame [m] into depth (h,w, zeros; +inf = nothing), face ids.

    Pixel centres are integers. 1/z is linear over the image of a triangle, so depth is exact.
    Triangles that touch the near plane are left out, and those of a closed surface that face away.
    """
    u, v, inverse = _seen(vertices, fx, fy, cx, cy)
    for t in range(faces.shape[0]):
        draw_triangle(
            t, faces[t, 0], faces[t, 1], faces[t, 2], u, v, inverse, closed, depth, face_id)
    invert_depth(depth)


@njit(cache=True, nogil=True)
def rasterize_parts(vertices, faces, part, fx, fy, cx, cy, closed, depth):
    """Draw each part of a mesh into a depth image of its own (p,h,w, zeros; +inf = nothing)."""
    u, v, inverse = _seen(vertices, fx, fy, cx, cy)
    face_id = np.empty(depth.shape[1:], dtype=np.int32)
    for t in range(faces.shape[0]):
        draw_triangle(
            t, faces[t, 0], faces[t, 1], faces[t, 2], u, v, inverse, closed, depth[part[t]],
            face_id)
    for k in range(depth.shape[0]):
        invert_depth(depth[k])


@njit(cache=True, nogil=True)
def rasterize_alike(vertices, faces, fx, fy, cx, cy, closed, depth):
    """Draw versions of a mesh (k,n,3) into depth (k,h,w, zeros; +inf = nothing).

    What all versions have in common is drawn once.
    """
    k, n = vertices.shape[:2]
    differs = np.zeros(n, dtype=np.bool_)
    for m in range(1, k):
        for i in range(n):
            for c in range(3):
                if vertices[m, i, c] != vertices[0, i, c]:
                    differs[i] = True
    face_id = np.empty(depth.shape[1:], dtype=np.int32)
    u, v, inverse = _seen(vertices[0], fx, fy, cx, cy)
    for t in range(faces.shape[0]):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        if not (differs[a] or differs[b] or differs[c]):
            draw_triangle(t, a, b, c, u, v, inverse, closed, depth[0], face_id)
    for m in range(1, k):
        depth[m] = depth[0]
    for m in range(k):
        u, v, inverse = _seen(vertices[m], fx, fy, cx, cy)
        for t in range(faces.shape[0]):
            a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
            if differs[a] or differs[b] or differs[c]:
                draw_triangle(t, a, b, c, u, v, inverse, closed, depth[m], face_id)
        invert_depth(depth[m])


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
            for c in range(3):
                out[i, c] /= length
