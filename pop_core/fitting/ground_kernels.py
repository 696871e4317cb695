"""Numba kernel of the contact between feet and floor (see ground_contact.py)."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.fitting.robust_kernels import geman_mcclure


@njit(cache=True, nogil=True)
def contact(
    vertices, normal, offset, tolerance, below_weight, left_sole, right_sole, foot_weight,
    lifted_share, scale, power,
):
    """Return (vertex, direction, target, weight) of what should go onto the floor.

    Args:
        vertices: (n,3) of the body [m].
        normal: (3) unit normal of the floor.
        offset: Height of the camera above it [m].
        tolerance: How far below the floor nothing pulls [m].
        below_weight: Weight of each vertex that lies lower.
        left_sole: Vertices under the left foot.
        right_sole: The same of the right one.
        foot_weight: (2) weight of each sole, negative where it stays as it is.
        lifted_share: What is left of that weight for the foot that is higher.
        scale: Scale of the robust kernel of a sole's height [m].
        power: Power of the robust share.
    """
    n = vertices.shape[0]
    height = np.empty(n)
    lower = 0
    for i in range(n):
        x, y, z = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        height[i] = x * normal[0] + y * normal[1] + z * normal[2] + offset
        lower += height[i] < -tolerance
    most = lower + left_sole.shape[0] + right_sole.shape[0]
    vertex, weight = np.empty(most, dtype=np.int64), np.empty(most)
    count = 0
    for i in range(n):
        if height[i] < -tolerance:
            vertex[count], weight[count] = i, below_weight
            count += 1
    left, right = np.mean(height[left_sole]), np.mean(height[right_sole])
    for foot in range(2):
        if foot_weight[foot] < 0.0:
            continue
        sole, higher = (left_sole, left > right) if foot == 0 else (right_sole, right > left)
        worth = foot_weight[foot] * (lifted_share if higher else 1.0) / sole.shape[0]
        for i in sole:
            vertex[count] = i
            weight[count] = worth * geman_mcclure(height[i] ** 2, scale, power)
            count += 1
    direction, target = np.empty((count, 3)), np.empty((count, 3))
    for k in range(count):
        i = vertex[k]
        for c in range(3):
            direction[k, c] = normal[c]
            target[k, c] = vertices[i, c] - height[i] * normal[c]
    return vertex[:count], direction, target, weight[:count]
