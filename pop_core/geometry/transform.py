"""Rigid transforms `T_a_b` (4x4) with `p_a = T_a_b @ p_b`; equal letters meet."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def make_transform(
    R_a_b: Float[np.ndarray, '3 3'], t_a_b: Float[np.ndarray, '3']
) -> Float[np.ndarray, '4 4']:
    """Return T_a_b of a rotation and a translation [m]."""
    T_a_b = np.eye(4)
    T_a_b[:3, :3] = R_a_b
    T_a_b[:3, 3] = t_a_b
    return T_a_b


def invert_transform(T_a_b: Float[np.ndarray, '4 4']) -> Float[np.ndarray, '4 4']:
    """Return T_b_a."""
    R_b_a = T_a_b[:3, :3].T
    return make_transform(R_b_a, -R_b_a @ T_a_b[:3, 3])


def transform_points(
    T_a_b: Float[np.ndarray, '4 4'], p_b: Float[np.ndarray, '*n 3']
) -> Float[np.ndarray, '*n 3']:
    """Return points of frame b [m] expressed in frame a [m]."""
    return p_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]
