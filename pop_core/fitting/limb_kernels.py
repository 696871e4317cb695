"""Numba kernel that compares bones of many limbs with the depth image."""

from __future__ import annotations

import numpy as np
from numba import njit

NEAREST_M = 0.3


@njit(cache=True, nogil=True)
def bone_misfits(
    points, width, length, margin, measured, unexplained, fx, fy, cx, cy, floor, clothes, limit,
):
    """Return what each limb costs [px]: its pixels in the open, less those of surface it explains.

    Args:
        points: (n,p,3) along the bones, camera frame [m].
        width: (p) thickness of the limb [m].
        length: (p) how much of it each point stands for [m].
        margin: (n,p) how far before the measured surface the skin may lie [m].
        measured: (h,w) depth [m], NaN where there is none.
        unexplained: (h,w) surface of the person that nothing else explains.
        fx: Focal length across [px].
        fy: The same down.
        cx: Column of the principal point [px].
        cy: Row of it.
        floor: (4) normal and offset: heights above the floor [m].
        clothes: How far behind the margin a surface may still be the limb's [m].
        limit: Gap beyond which all of a pixel is in the open [m].
    """
    h, w = measured.shape
    cost = np.zeros(points.shape[0])
    for i in range(points.shape[0]):
        for k in range(points.shape[1]):
            x, y, z = points[i, k, 0], points[i, k, 1], points[i, k, 2]
            wrong = right = 0.0
            u = v = -1
            if z > 0.0:
                u, v = int(np.rint(fx * x / z + cx)), int(np.rint(fy * y / z + cy))
            if 0 <= u < w and 0 <= v < h and not np.isnan(measured[v, u]):
                gap = measured[v, u] - z + width[k] / 2.0
                wrong = min(max((gap - margin[i, k]) / limit, 0.0), 1.0)
                if unexplained[v, u]:
                    right = max(1.0 - abs(gap) / (margin[i, k] + clothes), 0.0)
            height = floor[0] * x + floor[1] * y + floor[2] * z + floor[3]
            wrong += min(max((-height - 0.02) / limit, 0.0), 1.0)
            per_metre = fx / max(z, NEAREST_M)
            cost[i] += length[k] * width[k] * per_metre * per_metre * (wrong - right)
    return cost
