"""Swing-twist coordinates of joint rotations [rad]: where a bone points, and its own turn.

A rotation is R = exp(swing) exp(twist * e_k): e_k is the coordinate axis nearest to the bone's
rest direction, and the swing vector is perpendicular to it. The three coordinates keep the order
x, y, z (the twist stands in slot k), so they equal the rotation vector to first order and mirror
like one. Unlike Euler angles they are regular until the bone points backwards (Grassia 1998).
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from pop_core.geometry import swing_twist_kernels as kernels


def to_swing_twist(
    rotvec: Float[np.ndarray, '*n j 3'], twist_axes: Int[np.ndarray, 'j']
) -> Float[np.ndarray, '*n j 3']:
    """Return the coordinates [rad] of rotation vectors [rad].

    Args:
        rotvec: Rotation vector of each joint [rad].
        twist_axes: 0, 1 or 2 per joint: the axis along which its bone lies at rest.

    Returns:
        Swing components in the two other slots, of length at most pi; twist within (-pi, pi].
    """
    flat = np.asarray(rotvec, dtype=np.float64).reshape(-1, len(twist_axes), 3)
    return np.asarray(kernels.decompose(flat, twist_axes)).reshape(rotvec.shape)


def from_swing_twist(
    coordinates: Float[np.ndarray, '*n j 3'], twist_axes: Int[np.ndarray, 'j']
) -> Float[np.ndarray, '*n j 3']:
    """Return rotation vectors [rad], of angle at most pi, of swing-twist coordinates [rad]."""
    flat = np.asarray(coordinates, dtype=np.float64).reshape(-1, len(twist_axes), 3)
    return np.asarray(kernels.compose(flat, twist_axes)).reshape(coordinates.shape)


def swing_twist_jacobian(
    coordinates: Float[np.ndarray, 'j 3'], twist_axes: Int[np.ndarray, 'j']
) -> Float[np.ndarray, 'j 3 3']:
    """Return d(coordinates)/d(delta) of each joint for a left increment R <- exp(delta) R.

    Grows without bound as a swing approaches pi, where the coordinates themselves break.
    """
    plain = np.asarray(coordinates, dtype=np.float64)
    return np.asarray(kernels.increment_jacobian(plain, twist_axes))
