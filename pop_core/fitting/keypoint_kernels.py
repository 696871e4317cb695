"""Numba kernels of E_J3D: robust weights and offsets of lifted joints and of keypoint rays."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.fitting.robust_kernels import geman_mcclure

NEAREST_M = 0.3  # a ray's spread does not shrink any further


@njit(cache=True, nogil=True)
def joint_weights(landmarks, positions, sigma, scale, power):
    """Return robust weights 1/sigma^2 (s) of joints, zero where no position (s,3) is known [m]."""
    out = np.zeros(landmarks.shape[0])
    for i in range(landmarks.shape[0]):
        square = 0.0
        for c in range(3):
            square += (landmarks[i, c] - positions[i, c]) ** 2
        if np.isfinite(square):
            out[i] = geman_mcclure(square, scale, power) / sigma[i] ** 2
    return out


@njit(cache=True, nogil=True)
def joint_offsets(landmarks, positions, weight):
    """Return (rows, r, w): joints (m) that weigh anything, their offsets (3m) [m] and weights."""
    rows = np.flatnonzero(weight > 0.0)
    r, w = np.empty(3 * rows.shape[0]), np.empty(3 * rows.shape[0])
    for k in range(rows.shape[0]):
        for c in range(3):
            r[3 * k + c] = landmarks[rows[k], c] - positions[rows[k], c]
            w[3 * k + c] = weight[rows[k]]
    return rows, r, w


@njit(cache=True, nogil=True)
def ray_offsets(landmarks, joint, across):
    """Return how far landmarks (s,3) lie from rays (n) along the two directions across (n,2,3)."""
    out = np.zeros((joint.shape[0], 2))
    for i in range(joint.shape[0]):
        for k in range(2):
            for c in range(3):
                out[i, k] += across[i, k, c] * landmarks[joint[i], c]
    return out


@njit(cache=True, nogil=True)
def ray_weights(landmarks, joint, across, score, sigma, scale, power):
    """Return robust weights 1/sigma^2 (s) of joints by their rays, zero for those without one.

    sigma is a slope, metres per metre of depth.
    """
    offset = ray_offsets(landmarks, joint, across)
    out = np.zeros(landmarks.shape[0])
    for i in range(joint.shape[0]):
        square = offset[i, 0] ** 2 + offset[i, 1] ** 2
        sigma_m = sigma * max(landmarks[joint[i], 2], NEAREST_M)
        out[joint[i]] = score[i] * geman_mcclure(square, scale, power) / sigma_m**2
    return out
