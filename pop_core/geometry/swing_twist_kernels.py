"""Numba kernels of swing-twist coordinates (see swing_twist.py for their meaning)."""

from __future__ import annotations

import numpy as np
from numba import njit

TINY = 1e-9


@njit(cache=True, nogil=True)
def decompose(rotvecs, twist_axes):
    """Return coordinates (n,j,3) [rad] of rotation vectors (n,j,3) [rad]."""
    out = np.empty(rotvecs.shape)
    q = np.empty(4)
    for i in range(rotvecs.shape[0]):
        for j in range(rotvecs.shape[1]):
            quaternion(rotvecs[i, j], q)
            decompose_quaternion(q, twist_axes[j], out[i, j])
    return out


@njit(cache=True, nogil=True)
def decompose_quaternion(q, k, out):
    """Fill coordinates (3) [rad] of a unit quaternion (scalar last, any sign), twist axis k."""
    a, b = (k + 1) % 3, (k + 2) % 3
    w, t = q[3], q[k]
    cosine = np.sqrt(w * w + t * t)  # of half the swing angle
    if cosine < TINY:
        w, t = 1.0, 0.0  # a half turn of the bone: any twist will do
    else:
        w, t = w / cosine, t / cosine
    # swing = q * conj(twist) has no part along the twist axis
    swing_a = q[a] * w - q[b] * t
    swing_b = q[b] * w + q[a] * t
    sine = np.sqrt(swing_a * swing_a + swing_b * swing_b)
    factor = 2.0 if sine < TINY else 2.0 * np.arctan2(sine, cosine) / sine
    twist = 2.0 * np.arctan2(t, w)
    out[a] = factor * swing_a
    out[b] = factor * swing_b
    out[k] = twist - 2.0 * np.pi * np.round(twist / (2.0 * np.pi))


@njit(cache=True, nogil=True)
def compose(coordinates, twist_axes):
    """Return rotation vectors (n,j,3) [rad] of coordinates (n,j,3) [rad]."""
    out = np.empty(coordinates.shape)
    for i in range(coordinates.shape[0]):
        for j in range(coordinates.shape[1]):
            k = twist_axes[j]
            a, b = (k + 1) % 3, (k + 2) % 3
            x, y = coordinates[i, j, a], coordinates[i, j, b]
            angle = np.sqrt(x * x + y * y)
            sine = 0.5 if angle < TINY else np.sin(0.5 * angle) / angle
            cosine = np.cos(0.5 * angle)
            ct, st = np.cos(0.5 * coordinates[i, j, k]), np.sin(0.5 * coordinates[i, j, k])
            x, y = sine * x, sine * y
            w = cosine * ct
            sign = 1.0 if w >= 0.0 else -1.0
            va, vb, vk = x * ct + y * st, y * ct - x * st, cosine * st
            length = np.sqrt(va * va + vb * vb + vk * vk)
            factor = 2.0 * sign
            if length > TINY:
                factor = 2.0 * sign * np.arctan2(length, sign * w) / length
            out[i, j, a], out[i, j, b], out[i, j, k] = factor * va, factor * vb, factor * vk
    return out


@njit(cache=True, nogil=True)
def excess(coordinates, lower, upper):
    """Return the signed excess (j,3) of coordinates (j,3) beyond lower and upper limits [rad]."""
    out = np.empty(coordinates.shape)
    for j in range(coordinates.shape[0]):
        for c in range(3):
            over = max(coordinates[j, c] - upper[j, c], 0.0)
            out[j, c] = over + min(coordinates[j, c] - lower[j, c], 0.0)
    return out


@njit(cache=True, nogil=True)
def increment_jacobian(coordinates, twist_axes):
    """Return d(coordinates)/d(delta) (j,3,3) for R <- exp(delta) R, of coordinates (j,3).

    A left increment is delta = Jl(swing) d(swing) + S e_k d(twist), so the wanted matrix is the
    inverse of [Jl e_a, Jl e_b, S e_k] with Jl the left Jacobian of SO(3).
    """
    n = coordinates.shape[0]
    out = np.empty((n, 3, 3))
    m = np.empty((3, 3))
    s = np.empty(3)
    for j in range(n):
        k = twist_axes[j]
        s[:] = coordinates[j]
        s[k] = 0.0
        angle2 = s[0] * s[0] + s[1] * s[1] + s[2] * s[2]
        angle = np.sqrt(angle2)
        if angle < 1e-4:
            sinc, cosc, sinc_rest = 1.0 - angle2 / 6.0, 0.5 - angle2 / 24.0, 1.0 / 6.0
        else:
            sinc = np.sin(angle) / angle
            cosc = (1.0 - np.cos(angle)) / angle2
            sinc_rest = (1.0 - sinc) / angle2
        cosine = 1.0 - cosc * angle2
        for column in range(3):
            # Rodrigues applied to e_column: Jl for the swing axes, S for the twist axis
            if column == k:
                along, turn, keep = cosc, sinc, cosine
            else:
                along, turn, keep = sinc_rest, cosc, sinc
            for row in range(3):
                m[row, column] = along * s[row] * s[column]
            m[column, column] += keep
            nxt, last = (column + 1) % 3, (column + 2) % 3
            m[nxt, column] += turn * s[last]
            m[last, column] -= turn * s[nxt]
        _invert(m, out[j])
    return out


@njit(cache=True, nogil=True)
def quaternion(rotvec, q):
    """Fill the unit quaternion q (4), scalar last, of a rotation vector (3) [rad]."""
    angle = np.sqrt(rotvec[0] ** 2 + rotvec[1] ** 2 + rotvec[2] ** 2)
    factor = 0.5 if angle < TINY else np.sin(0.5 * angle) / angle
    q[0], q[1], q[2] = factor * rotvec[0], factor * rotvec[1], factor * rotvec[2]
    q[3] = np.cos(0.5 * angle)


@njit(cache=True, nogil=True)
def _invert(m, out):
    for r in range(3):
        for c in range(3):
            a, b = (c + 1) % 3, (c + 2) % 3
            d, e = (r + 1) % 3, (r + 2) % 3
            out[r, c] = m[a, d] * m[b, e] - m[a, e] * m[b, d]
    determinant = m[0, 0] * out[0, 0] + m[0, 1] * out[1, 0] + m[0, 2] * out[2, 0]
    for r in range(3):
        for c in range(3):
            out[r, c] /= determinant
