"""Numba kernels of the body tree: posed as a whole, and turned by a step."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.body.skinning_kernels import forward_kinematics
from pop_core.geometry.rotation_kernels import products, rotation_matrices, rotation_vectors


@njit(cache=True, nogil=True)
def pose_tree(global_orient, body_pose, betas, joint_template, joint_shapedirs, parents):
    """Return (R_local, rest_joints, G, p) of a body; see `kinematics.PosedSkeleton`."""
    n = joint_template.shape[0]
    rotvecs, rest_joints = np.empty((n, 3)), joint_template.copy()
    rotvecs[0], rotvecs[1:] = global_orient, body_pose
    for j in range(n):
        for c in range(3):
            for b in range(betas.shape[0]):
                rest_joints[j, c] += joint_shapedirs[j, c, b] * betas[b]
    R_local = rotation_matrices(rotvecs)
    G, p = forward_kinematics(R_local, rest_joints, parents)
    return R_local, rest_joints, G, p


@njit(cache=True, nogil=True)
def turned(increments, R_local):
    """Return rotation vectors (j,3) [rad] of exp(increment) R per joint."""
    return rotation_vectors(products(rotation_matrices(increments), R_local))
