"""Numba kernels of normal equations: rows weighted, products unfolded, systems damped."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def weigh(J, r, w, out):
    """Fill out (n,x+1) with rows of J (n,x) and r (n), both times the roots of weights w (n)."""
    size = J.shape[1]
    for i in range(J.shape[0]):
        root = np.sqrt(w[i])
        for k in range(size):
            out[i, k] = root * J[i, k]
        out[i, size] = root * r[i]


@njit(cache=True, nogil=True)
def with_lower(upper):
    """Return the symmetric matrix (x,x) of an upper triangle, whatever stands below."""
    n = upper.shape[0]
    out = np.empty((n, n))
    for a in range(n):
        for b in range(a + 1):
            out[a, b] = out[b, a] = upper[b, a]
    return out


@njit(cache=True, nogil=True)
def unfold(upper):
    """Return gradient J'r (x) and Hessian J'J (x,x) of the upper triangle of [J r]'[J r]."""
    size = upper.shape[0] - 1
    return upper[:size, size].copy(), with_lower(upper[:size, :size])


@njit(cache=True, nogil=True)
def add(of_gradient, of_hessian, first, gradient, hessian):
    """Add a term's gradient (y) and Hessian (y,y) to those of all parameters, in place."""
    for a in range(of_gradient.shape[0]):
        gradient[first + a] += of_gradient[a]
        for b in range(of_gradient.shape[0]):
            hessian[first + a, first + b] += of_hessian[a, b]


@njit(cache=True, nogil=True)
def damp(hessian, gradient, free, damping, least):
    """Return Hessian (y,y) and gradient (y) of parameters that are free, the first one damped.

    Damping is relative to the diagonal, and by `least` where that is zero.
    """
    n = free.shape[0]
    out, slope = np.empty((n, n)), np.empty(n)
    for a in range(n):
        slope[a] = gradient[free[a]]
        for b in range(n):
            out[a, b] = hessian[free[a], free[b]]
        out[a, a] += damping * (out[a, a] + least)
    return out, slope
