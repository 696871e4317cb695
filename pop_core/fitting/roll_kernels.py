"""Numba kernel of bone rolls: what every reading of a hinged limb costs (see bone_rolls.py)."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.geometry.swing_twist_kernels import decompose_quaternion, quaternion


@njit(cache=True, nogil=True)
def _product(p, q, out):
    """Fill the quaternion (scalar last) of turning by q, then by p."""
    out[0] = p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1]
    out[1] = p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0]
    out[2] = p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3]
    out[3] = p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]


@njit(cache=True, nogil=True)
def _strain(q, twist_axis, lower, upper, ease):
    """Return by how much a joint exceeds its limits (3), squared, and a little of its turn."""
    c = np.empty(3)
    decompose_quaternion(q, twist_axis, c)
    cost = 0.0
    for a in range(3):
        excess = max(c[a] - upper[a], 0.0) + min(c[a] - lower[a], 0.0)
        cost += excess * excess + ease * c[a] * c[a]
    return cost


@njit(cache=True, nogil=True)
def reading_costs(rotvecs, bones, angles, twist_axes, lower, upper, ease):
    """Return what readings cost (twist of the lower bone, roll of the upper one).

    Args:
        rotvecs: (2,3) rotations of upper bone and hinge [rad].
        bones: (2,3) unit vectors along both bones at rest.
        angles: (n) of both [rad].
        twist_axes: (2) of both joints.
        lower: (2,3) limits [rad].
        upper: (2,3) limits [rad].
        ease: Weight of coordinates within the limits.
    """
    n = angles.shape[0]
    out = np.empty((n, n))
    rolls, twists = np.empty((n, 4)), np.empty((n, 4))
    for i in range(n):
        quaternion(angles[i] * bones[0], rolls[i])
        quaternion(angles[i] * bones[1], twists[i])
    top, hinge, q, bent = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    quaternion(rotvecs[0], top)
    quaternion(rotvecs[1], hinge)
    back = np.empty(4)
    for i in range(n):
        _product(top, rolls[i], q)
        of_upper = _strain(q, twist_axes[0], lower[0], upper[0], ease)
        back[:3], back[3] = -rolls[i, :3], rolls[i, 3]
        _product(back, hinge, bent)
        for k in range(n):
            _product(bent, twists[k], q)
            out[k, i] = of_upper + _strain(q, twist_axes[1], lower[1], upper[1], ease)
    return out
