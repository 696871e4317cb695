"""Numba kernels of the pose prior: its nearest component, and the quadratic model of that."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.geometry.block_kernels import sandwich
from pop_core.geometry.swing_twist_kernels import increment_jacobian


@njit(cache=True, nogil=True)
def nearest_component(c, means, whiteners, peak_costs):
    """Return the least -log(weight * density) of all components at coordinates c (x), and whose.

    Whiteners (k,x,x) are lower triangles. A component is given up as soon as its sum of squares
    costs more than the best so far.
    """
    least, best = np.inf, 0
    n = c.shape[0]
    off = np.empty(n)
    for k in range(means.shape[0]):
        for i in range(n):
            off[i] = c[i] - means[k, i]
        cost = peak_costs[k]
        for i in range(n):
            if cost >= least:
                break
            white = 0.0
            for j in range(i + 1):
                white += whiteners[k, i, j] * off[j]
            cost += 0.5 * white * white
        if cost < least:
            least, best = cost, k
    return least, best


@njit(cache=True, nogil=True)
def increment_model(c, mean, precision, twist_axes):
    """Return gradient (3j) and Hessian (3j,3j) of 1/2 (c - mean)' precision (c - mean).

    Derivatives are with respect to left increments of the joints whose coordinates are c (j,3).
    """
    n = c.shape[0]
    pull = np.zeros(3 * n)
    for a in range(3 * n):
        for b in range(3 * n):
            pull[a] += precision[a, b] * (c[b // 3, b % 3] - mean[b])
    turn = increment_jacobian(c, twist_axes)
    gradient = np.zeros(3 * n)
    for j in range(n):
        for a in range(3):
            for b in range(3):
                gradient[3 * j + b] += turn[j, a, b] * pull[3 * j + a]
    return gradient, sandwich(precision, turn, 0)
