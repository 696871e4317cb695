"""Numba kernels that build libraries: joints of many poses."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.body.skinning_kernels import forward_kinematics
from pop_core.geometry.rotation_kernels import rotation_matrices


@njit(cache=True, nogil=True)
def upright_joints(body_pose, tilt, rest_joints, parents, carriers, arms):
    """Return joints (s,3,m) float32 [m] of poses about the pelvis, in the upright frame.

    Args:
        body_pose: Rotation vectors (m,23,3) [rad].
        tilt: Rotation vector of the pelvis (m,3) [rad].
        rest_joints: Joints at rest (24,3) [m].
        parents: Parent of each joint (24).
        carriers: Joint that carries each wanted point (s).
        arms: Rest offset of each wanted point from its carrier (s,3) [m].
    """
    m, s = body_pose.shape[0], carriers.shape[0]
    out = np.empty((s, 3, m), dtype=np.float32)
    rotvecs = np.empty((24, 3))
    for i in range(m):
        rotvecs[0] = tilt[i]
        rotvecs[1:] = body_pose[i]
        G, p = forward_kinematics(rotation_matrices(rotvecs), rest_joints, parents)
        for k in range(s):
            j = carriers[k]
            for r in range(3):
                value = p[j, r] - p[0, r]
                for c in range(3):
                    value += G[j, r, c] * arms[k, c]
                out[k, r, i] = value
    return out
