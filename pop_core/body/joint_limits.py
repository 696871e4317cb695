"""Anatomical limits of the 23 joints in swing-twist coordinates [rad], and what exceeds them.

T-pose rest, y up, facing +z, the person's left is +x. The bounds are generous: they hold the
ranges of healthy adults (Kapandji 1982; Boone and Azen 1979) plus what clothes, soft spines and
other conventions of the same pose need, and exist to forbid knees that bend forward.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_NAMES, MIRROR
from pop_core.geometry import swing_twist_kernels as kernels
from pop_core.geometry.swing_twist import to_swing_twist

# Joint without side: twist axis, then lower and upper bounds about x, y, z of the left joint.
_TABLE = {
    'hip': ('y', (-2.35, -1.0, -0.6), (0.6, 1.0, 1.25)),
    'spine1': ('y', (-0.5, -0.5, -0.45), (1.0, 0.5, 0.45)),
    'knee': ('y', (-0.08, -0.45, -0.15), (2.6, 0.45, 0.15)),
    'spine2': ('y', (-0.35, -0.4, -0.35), (0.7, 0.4, 0.35)),
    'ankle': ('z', (-0.75, -0.65, -0.45), (0.9, 0.65, 0.45)),
    'spine3': ('y', (-0.35, -0.4, -0.35), (0.6, 0.4, 0.35)),
    'foot': ('z', (-0.9, -0.15, -0.15), (0.5, 0.15, 0.15)),
    'neck': ('y', (-0.6, -0.8, -0.55), (0.7, 0.8, 0.55)),
    'collar': ('x', (-0.3, -0.5, -0.35), (0.3, 0.4, 0.6)),
    'head': ('y', (-0.9, -0.8, -0.55), (0.6, 0.8, 0.55)),
    'shoulder': ('x', (-1.9, -2.3, -1.8), (1.9, 1.1, 1.8)),
    'elbow': ('x', (-1.5, -2.65, -0.6), (1.5, 0.1, 0.6)),
    'wrist': ('x', (-1.1, -0.7, -1.3), (1.1, 0.7, 1.2)),
    'hand': ('x', (-0.3, -0.3, -1.6), (0.3, 0.3, 0.5)),
}
_BODY_NAMES = JOINT_NAMES[1:]


def _limits() -> Float[np.ndarray, '2 23 3']:
    bounds = np.empty((2, len(_BODY_NAMES), 3))
    for row, name in enumerate(_BODY_NAMES):
        _, *left = _TABLE[name.split('_')[-1]]
        bounds[:, row] = left
        if name.startswith('right_'):
            # A mirror keeps turns about x and flips those about y and z.
            bounds[0, row, 1:], bounds[1, row, 1:] = -bounds[1, row, 1:], -bounds[0, row, 1:]
    return bounds


TWIST_AXES = np.array(['xyz'.index(_TABLE[name.split('_')[-1]][0]) for name in _BODY_NAMES])
LOWER, UPPER = _limits()
BODY_MIRROR = MIRROR[1:] - 1


def pose_coordinates(body_pose: Float[np.ndarray, '*n 23 3']) -> Float[np.ndarray, '*n 23 3']:
    """Return swing-twist coordinates [rad] of body poses (rotation vectors [rad])."""
    return to_swing_twist(body_pose, TWIST_AXES)


def mirrored_pose(body_pose: Float[np.ndarray, '*n 23 3']) -> Float[np.ndarray, '*n 23 3']:
    """Return the pose seen in a mirror: sides swapped, turns about y and z reversed."""
    signs = np.array([1.0, -1.0, -1.0], dtype=body_pose.dtype)
    return np.asarray(body_pose[..., BODY_MIRROR, :] * signs)


def limit_excess(coordinates: Float[np.ndarray, '23 3']) -> Float[np.ndarray, '23 3']:
    """Return the signed excess [rad] of each coordinate beyond its limits, zero within them."""
    return np.asarray(kernels.excess(coordinates, LOWER, UPPER))
