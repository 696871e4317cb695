"""Numba kernels of Eq. (1): the best similarity of every library pose at once.

The sum of singular values that a rotation can reach, s1 + s2 + sign(det) s3, is the largest root
of a quartic in the entries of the 3x3 cross-covariance (Horn 1987; Theobald 2005). Newton's method
from an upper bound has no branches, so blocks of poses run through the vector unit. Whole columns
are passed with a range: a slice of them would lose the stride of one that the vector unit needs.
"""

from __future__ import annotations

import numpy as np
from numba import njit

BLOCK = 128
NEWTON_STEPS = 7
SQRT3 = np.float32(1.7320508)


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def similarity_costs(
    columns, chosen, target, weight, limits, yaw_only, upright, sized, out, first, last
):
    """Fill out[first:last] with weighted mean squared distances [m^2] after the best similarity.

    Args:
        columns: Joints of the library (s,3,m) float32 [m].
        chosen: Indices (n) of the joints to compare.
        target: Measured joints (n,3) float32 [m], weighted mean removed.
        weight: Weights (n) float32 that sum to one.
        limits: Smallest and largest scale (2) float32.
        yaw_only: Whether rotations are restricted to turns about y.
        upright: Cost [m^2] per unit of scale * |y - R y|^2: the price of leaning.
        sized: Cost [m^2] per unit of (scale - 1)^2: the price of children and giants.
        out: Costs (m) float32.
        first: First pose.
        last: One past the last pose.
    """
    n = chosen.shape[0]
    spread = sized
    for k in range(n):
        for r in range(3):
            spread += weight[k] * target[k, r] * target[k, r]
    sums = np.empty((13, BLOCK), dtype=np.float32)
    for start in range(first, last, BLOCK):
        size = min(BLOCK, last - start)
        sums[:] = np.float32(0.0)
        for k in range(n):
            j, w = chosen[k], weight[k]
            a, b, c = w * target[k, 0], w * target[k, 1], w * target[k, 2]
            for i in range(size):
                x = columns[j, 0, start + i]
                y = columns[j, 1, start + i]
                z = columns[j, 2, start + i]
                sums[0, i] += w * x
                sums[1, i] += w * y
                sums[2, i] += w * z
                sums[3, i] += w * (x * x + y * y + z * z)
                sums[4, i] += a * x
                sums[5, i] += a * y
                sums[6, i] += a * z
                sums[7, i] += b * x
                sums[8, i] += b * y
                sums[9, i] += b * z
                sums[10, i] += c * x
                sums[11, i] += c * y
                sums[12, i] += c * z
        if yaw_only:
            _yaw_costs(sums, size, spread, limits, sized, out[start:])
        else:
            _free_costs(sums, size, spread, limits, upright, sized, out[start:])
    return out


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def _free_costs(sums, size, spread, limits, upright, sized, out):
    """Fill costs of rotations of any axis.

    The price of leaning is one more correspondence, y to y, in the cross-covariance.
    """
    tiny, one, two = np.float32(1e-12), np.float32(1.0), np.float32(2.0)
    for i in range(size):
        own = sized + sums[3, i] - sums[0, i] ** 2 - sums[1, i] ** 2 - sums[2, i] ** 2
        a, b, c = sums[4, i], sums[5, i], sums[6, i]
        d, e, f = sums[7, i], sums[8, i] + upright, sums[9, i]
        g, h, k = sums[10, i], sums[11, i], sums[12, i]
        norm2 = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + k * k + tiny
        p, q, r = e * k - f * h, f * g - d * k, d * h - e * g
        determinant = a * p + b * q + c * r
        cofactors = (
            p * p + q * q + r * r
            + (b * k - c * h) ** 2 + (a * k - c * g) ** 2 + (a * h - b * g) ** 2
            + (b * f - c * e) ** 2 + (a * f - c * d) ** 2 + (a * e - b * d) ** 2)
        norm = np.sqrt(norm2)
        # With the matrix scaled to norm one: x^4 - 2 x^2 + c1 x + c0 = 0, largest root below
        # sqrt(3)
        c1 = np.float32(-8.0) * determinant / (norm2 * norm)
        c0 = one - np.float32(4.0) * cofactors / (norm2 * norm2)
        x = SQRT3
        for _ in range(NEWTON_STEPS):
            x2 = x * x
            value = (x2 - two) * x2 + c1 * x + c0
            slope = np.float32(4.0) * x * (x2 - one) + c1
            x = x - value / (slope + np.float32(1e-6))
        reach = x * norm - upright + sized
        scale = min(max(reach / (own + tiny), limits[0]), limits[1])
        out[i] = max(spread + scale * (scale * own - two * reach), np.float32(0.0))


@njit(cache=True, nogil=True, fastmath=True, error_model='numpy')
def _yaw_costs(sums, size, spread, limits, sized, out):
    """Fill costs of rotations about y alone."""
    tiny, two = np.float32(1e-12), np.float32(2.0)
    for i in range(size):
        own = sized + sums[3, i] - sums[0, i] ** 2 - sums[1, i] ** 2 - sums[2, i] ** 2
        cosine = sums[4, i] + sums[12, i]
        sine = sums[6, i] - sums[10, i]
        reach = np.sqrt(cosine * cosine + sine * sine) + sums[8, i] + sized
        scale = min(max(reach / (own + tiny), limits[0]), limits[1])
        out[i] = max(spread + scale * (scale * own - two * reach), np.float32(0.0))
