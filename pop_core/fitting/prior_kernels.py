"""Numba kernels of priors of single joints: each term depends on the rotation of one joint."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.geometry.rotation_kernels import (
    left_jacobian_inverse,
    products,
    rotation_matrices,
    rotation_vectors,
)
from pop_core.geometry.swing_twist_kernels import increment_jacobian


@njit(cache=True, nogil=True)
def _model(r, J, weight):
    """Return gradient (3j) and Hessian (3j,3j) of weight/2 |r|^2: r (j,3), J (j,3,3) per joint."""
    n = r.shape[0]
    gradient, hessian = np.zeros(3 * n), np.zeros((3 * n, 3 * n))
    for j in range(n):
        for a in range(3):
            for k in range(3):
                gradient[3 * j + a] += weight * J[j, k, a] * r[j, k]
                for b in range(3):
                    hessian[3 * j + a, 3 * j + b] += weight * J[j, k, a] * J[j, k, b]
    return gradient, hessian


@njit(cache=True, nogil=True)
def turns(R, pose, sigma):
    """Return rotation vectors (j,3) [rad] from poses (j,3) [rad] to R (j,3,3), over sigma (j)."""
    out = rotation_vectors(products(R, rotation_matrices(pose).transpose(0, 2, 1)))
    for j in range(R.shape[0]):
        out[j] /= sigma[j]
    return out


@njit(cache=True, nogil=True)
def turns_model(r, sigma, weight):
    """Return gradient and Hessian of weight/2 |r|^2 of `turns` r (j,3)."""
    turn = np.empty(r.shape)
    for j in range(r.shape[0]):
        turn[j] = r[j] * sigma[j]
    J = left_jacobian_inverse(turn)
    for j in range(r.shape[0]):
        J[j] /= sigma[j]
    return _model(r, J, weight)


@njit(cache=True, nogil=True)
def excess_model(r, coordinates, twist_axes, weight):
    """Return gradient and Hessian of weight/2 |r|^2 of what exceeds limits, r (j,3)."""
    J = increment_jacobian(coordinates, twist_axes)
    for j in range(r.shape[0]):
        for a in range(3):
            if r[j, a] == 0.0:
                J[j, a] = 0.0
    return _model(r, J, weight)
