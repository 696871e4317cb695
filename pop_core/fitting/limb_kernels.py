"""Numba kernels of many ways of one limb: where its bones are, and what the depth image says."""

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


@njit(cache=True, nogil=True)
def chain_points(turns, above, start, bones, bone, share):
    """Return (points, ends) of limbs: (n,p,3) along their bones, (n,2,3) second and third joint.

    Args:
        turns: (n,3,3,3) rotations of the three joints, each in the frame of the one before.
        above: (3,3) rotation of what carries the first joint.
        start: (3) the first joint, camera frame [m].
        bones: (3,3) at rest [m].
        bone: (p) bone of each point.
        share: (p) how far along it the point lies, 0..1.
    """
    points = np.empty((turns.shape[0], bone.shape[0], 3))
    ends = np.empty((turns.shape[0], 2, 3))
    frame, turned, joint = np.empty((3, 3)), np.empty((3, 3)), np.empty((4, 3))
    joint[0] = start
    for i in range(turns.shape[0]):
        frame[:] = above
        for k in range(3):
            for r in range(3):
                joint[k + 1, r] = joint[k, r]
                for c in range(3):
                    turned[r, c] = (
                        frame[r, 0] * turns[i, k, 0, c] + frame[r, 1] * turns[i, k, 1, c]
                        + frame[r, 2] * turns[i, k, 2, c])
                    joint[k + 1, r] += turned[r, c] * bones[k, c]
            frame[:] = turned
        ends[i, 0], ends[i, 1] = joint[1], joint[2]
        for p in range(bone.shape[0]):
            k = bone[p]
            for c in range(3):
                points[i, p, c] = joint[k, c] + share[p] * (joint[k + 1, c] - joint[k, c])
    return points, ends
