"""Numba kernels of the exponential and logarithm of rotations (float64, one thread, no GIL)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def rotation_matrices(rotvecs):
    """Return rotation matrices (n,3,3) of rotation vectors (n,3) [rad] (Rodrigues)."""
    out = np.empty((rotvecs.shape[0], 3, 3))
    for i in range(rotvecs.shape[0]):
        x, y, z = rotvecs[i, 0], rotvecs[i, 1], rotvecs[i, 2]
        angle2 = x * x + y * y + z * z
        if angle2 < 1e-14:
            a, b, c = 1.0, 0.5, 1.0 - 0.5 * angle2
        else:
            angle = np.sqrt(angle2)
            a, b, c = np.sin(angle) / angle, (1.0 - np.cos(angle)) / angle2, np.cos(angle)
        out[i, 0, 0], out[i, 1, 1], out[i, 2, 2] = c + b * x * x, c + b * y * y, c + b * z * z
        out[i, 0, 1], out[i, 1, 0] = b * x * y - a * z, b * x * y + a * z
        out[i, 0, 2], out[i, 2, 0] = b * x * z + a * y, b * x * z - a * y
        out[i, 1, 2], out[i, 2, 1] = b * y * z - a * x, b * y * z + a * x
    return out


@njit(cache=True, nogil=True)
def products(first, second):
    """Return the products (n,3,3) of matrices (n,3,3), one by one."""
    out = np.zeros(first.shape)
    for i in range(first.shape[0]):
        for r in range(3):
            for c in range(3):
                for k in range(3):
                    out[i, r, c] += first[i, r, k] * second[i, k, c]
    return out


@njit(cache=True, nogil=True)
def rotation_vectors(matrices):
    """Return rotation vectors (n,3) [rad], of angle at most pi, of rotation matrices (n,3,3).

    By way of the quaternion, from its largest component (Shepperd 1978): exact near a half turn.
    """
    out = np.empty((matrices.shape[0], 3))
    for i in range(matrices.shape[0]):
        m = matrices[i]
        trace = m[0, 0] + m[1, 1] + m[2, 2]
        if trace > max(m[0, 0], m[1, 1], m[2, 2]):
            w = 1.0 + trace
            x, y, z = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
        elif m[0, 0] >= m[1, 1] and m[0, 0] >= m[2, 2]:
            w = m[2, 1] - m[1, 2]
            x = 1.0 + m[0, 0] - m[1, 1] - m[2, 2]
            y, z = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]
        elif m[1, 1] >= m[2, 2]:
            w = m[0, 2] - m[2, 0]
            y = 1.0 + m[1, 1] - m[0, 0] - m[2, 2]
            x, z = m[0, 1] + m[1, 0], m[1, 2] + m[2, 1]
        else:
            w = m[1, 0] - m[0, 1]
            z = 1.0 + m[2, 2] - m[0, 0] - m[1, 1]
            x, y = m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
        if w < 0.0:
            w, x, y, z = -w, -x, -y, -z
        sine = np.sqrt(x * x + y * y + z * z)
        factor = 2.0 * np.arctan2(sine, w) / sine if sine > 1e-12 * w else 2.0 / w
        out[i, 0], out[i, 1], out[i, 2] = factor * x, factor * y, factor * z
    return out


@njit(cache=True, nogil=True)
def left_jacobian_inverse(rotvecs):
    """Return the inverse left Jacobians of SO(3) (n,3,3) at rotation vectors (n,3) [rad]."""
    out = np.empty((rotvecs.shape[0], 3, 3))
    for i in range(rotvecs.shape[0]):
        v = rotvecs[i]
        angle2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
        angle = np.sqrt(angle2)
        if angle < 1e-4:
            factor = 1.0 / 12.0
        elif angle > np.pi - 1e-6:
            factor = 1.0 / np.pi**2  # the limit at a half turn of what is 0/0 there
        else:
            factor = 1.0 / angle2 - (1.0 + np.cos(angle)) / (2.0 * angle * np.sin(angle))
        for row in range(3):
            for column in range(3):
                out[i, row, column] = factor * v[row] * v[column]
            out[i, row, row] += 1.0 - factor * angle2
            nxt, last = (row + 1) % 3, (row + 2) % 3
            out[i, row, nxt] += 0.5 * v[last]
            out[i, row, last] -= 0.5 * v[nxt]
    return out
