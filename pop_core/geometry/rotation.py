"""Rotations as matrices, rotation vectors [rad] and quaternions (scalar last)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pop_core.geometry import rotation_kernels as kernels


def from_rotvec(rotvec: Float[np.ndarray, '*n 3']) -> Float[np.ndarray, '*n 3 3']:
    """Return rotation matrices of rotation vectors [rad] (Rodrigues)."""
    flat = np.ascontiguousarray(rotvec, dtype=np.float64).reshape(-1, 3)
    return kernels.rotation_matrices(flat).reshape(*rotvec.shape, 3)


def to_rotvec(matrix: Float[np.ndarray, '*n 3 3']) -> Float[np.ndarray, '*n 3']:
    """Return rotation vectors [rad], of angle at most pi, of rotation matrices."""
    flat = np.ascontiguousarray(matrix, dtype=np.float64).reshape(-1, 3, 3)
    return kernels.rotation_vectors(flat).reshape(matrix.shape[:-1])


def to_quat_xyzw(matrix: Float[np.ndarray, '*n 3 3']) -> Float[np.ndarray, '*n 4']:
    """Return unit quaternions, scalar last and not negative, of rotation matrices."""
    flat = np.asarray(matrix, dtype=np.float64).reshape(-1, 3, 3)
    quat = Rotation.from_matrix(flat).as_quat(canonical=True)
    return quat.reshape(*matrix.shape[:-2], 4)


def nearest_rotation(matrix: Float[np.ndarray, '3 3']) -> Float[np.ndarray, '3 3']:
    """Return the rotation nearest to a 3x3 matrix in the Frobenius norm (Kabsch 1976)."""
    u, _, vt = np.linalg.svd(matrix)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    return u @ (signs[:, None] * vt)


def left_jacobian_inverse(rotvec: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n 3 3']:
    """Return d(log(exp(delta) R))/d(delta) at delta = 0 for R = exp(rotvec) (Chirikjian 2012)."""
    return np.asarray(kernels.left_jacobian_inverse(np.asarray(rotvec, dtype=np.float64)))
