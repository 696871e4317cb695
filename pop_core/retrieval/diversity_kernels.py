"""Numba kernel that chooses poses which together cover the belief about a person."""

from __future__ import annotations

import numpy as np
from numba import njit

# From 0 to 1 the fit at the seen joints improves and the guess at hidden ones gets worse; 0.3 is
# best at the mean over all joints (benchmarks/retrieval).
LOYALTY = 0.3


@njit(cache=True, nogil=True)
def cover(points, belief, width, chosen, owner):
    """Choose poses one by one so that as much belief as possible lies near a chosen one.

    A pose at mean distance d from a chosen one counts as covered by 1 / (1 + (d / width)^4): all
    of it within the width, next to nothing at twice the width. What a pose covers is multiplied by
    its own belief to the power LOYALTY: of two that cover alike, the one that fits better.

    Args:
        points: Places (n,k,3) [m] of the joints that count.
        belief: Belief (n) in each pose.
        width: Distance [m] within which a fit can pull a pose to the truth.
        chosen: Filled with the chosen indices.
        owner: Filled with the position in `chosen` that covers each pose (n) best.
    """
    n, joints = points.shape[0], points.shape[1]
    near = np.empty((n, n), dtype=np.float32)
    for i in range(n):
        near[i, i] = 1.0
        for other in range(i):
            total = 0.0
            for k in range(joints):
                x = points[i, k, 0] - points[other, k, 0]
                y = points[i, k, 1] - points[other, k, 1]
                z = points[i, k, 2] - points[other, k, 2]
                total += np.sqrt(x * x + y * y + z * z)
            ratio = total / (joints * width)
            near[i, other] = 1.0 / (1.0 + ratio**4)
            near[other, i] = near[i, other]
    own = (belief / belief.max()) ** LOYALTY
    covered = np.zeros(n)
    free = np.ones(n, dtype=np.bool_)
    owner[:] = 0
    for step in range(chosen.shape[0]):
        best, most = 0, -1.0
        for i in range(n):
            gain = 0.0
            for other in range(n):
                more = near[i, other] - covered[other]
                if more > 0.0:
                    gain += more * belief[other]
            if free[i] and own[i] * gain > most:
                best, most = i, own[i] * gain
        chosen[step] = best
        free[best] = False
        for other in range(n):
            if near[best, other] > covered[other]:
                covered[other] = near[best, other]
                owner[other] = step
