"""Numba kernels that meet pixel rays with rooms and solid primitives (one thread, no GIL)."""

from __future__ import annotations

import numpy as np
from numba import njit

BOX, CYLINDER = 0, 1  # blocks.Shape; any other value is an ellipsoid
NEAR_M = 0.02


@njit(cache=True, nogil=True)
def cast_room(low, high, eye, R_room_camera, fx, fy, cx, cy, depth):
    """Fill depth (h,w) with the distance along z [m] to the inner faces of a box (room frame).

    Faces at infinity are open. `eye` lies inside.
    """
    h, w = depth.shape
    for y in range(h):
        for x in range(w):
            rx, ry = (x - cx) / fx, (y - cy) / fy
            nearest = np.inf
            for k in range(3):
                d = R_room_camera[k, 0] * rx + R_room_camera[k, 1] * ry + R_room_camera[k, 2]
                if d > 1e-9:
                    t = (high[k] - eye[k]) / d
                elif d < -1e-9:
                    t = (low[k] - eye[k]) / d
                else:
                    continue
                nearest = min(nearest, t)
            depth[y, x] = nearest


@njit(cache=True, nogil=True)
def cast_block(shape, half, R_block_camera, eye, fx, fy, cx, cy, window, depth):
    """Lower depth (h,w) to a primitive's within a window (left, top, right, bottom).

    Args are the primitive's half extents (3,), the camera's axes and its eye in the primitive's
    own frame, whose origin is the primitive's centre [m]. A ray's parameter is depth along z,
    because its direction has z = 1 in the camera frame.
    """
    for y in range(window[1], window[3] + 1):
        for x in range(window[0], window[2] + 1):
            rx, ry = (x - cx) / fx, (y - cy) / fy
            dx = R_block_camera[0, 0] * rx + R_block_camera[0, 1] * ry + R_block_camera[0, 2]
            dy = R_block_camera[1, 0] * rx + R_block_camera[1, 1] * ry + R_block_camera[1, 2]
            dz = R_block_camera[2, 0] * rx + R_block_camera[2, 1] * ry + R_block_camera[2, 2]
            enter, leave = -np.inf, np.inf
            if shape == BOX:
                enter, leave = _slab(eye[0], dx, half[0], enter, leave)
                enter, leave = _slab(eye[1], dy, half[1], enter, leave)
                enter, leave = _slab(eye[2], dz, half[2], enter, leave)
            else:
                ox, oz, ux, uz = eye[0] / half[0], eye[2] / half[2], dx / half[0], dz / half[2]
                a, b, c = ux * ux + uz * uz, ox * ux + oz * uz, ox * ox + oz * oz - 1.0
                if shape != CYLINDER:
                    oy, uy = eye[1] / half[1], dy / half[1]
                    a, b, c = a + uy * uy, b + oy * uy, c + oy * oy
                discriminant = b * b - a * c
                if a > 1e-12:
                    if discriminant < 0.0:
                        continue
                    root = np.sqrt(discriminant)
                    enter, leave = (-b - root) / a, (-b + root) / a
                elif c > 0.0:
                    continue
                if shape == CYLINDER:
                    enter, leave = _slab(eye[1], dy, half[1], enter, leave)
            if enter < leave and NEAR_M < enter < depth[y, x]:
                depth[y, x] = enter


@njit(cache=True, nogil=True)
def _slab(origin, direction, half, enter, leave):
    """Return the interval of a ray cut to |coordinate| <= half."""
    if abs(direction) < 1e-9:
        return (enter, leave) if abs(origin) <= half else (np.inf, -np.inf)
    a, b = (-half - origin) / direction, (half - origin) / direction
    return max(enter, min(a, b)), min(leave, max(a, b))
