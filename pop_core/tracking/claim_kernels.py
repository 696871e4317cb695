"""Numba kernel of claims: how much of a limb's point nothing surer explains."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def claimed_shares(points, limb, sigma, alone, before, rim, fx, fy, cx, cy):
    """Return 0..1 per point: how little it is explained by what is surer than its limb.

    Args:
        points: (n,3) measured points [m].
        limb: (n) the limb that each would belong to.
        sigma: (n) standard deviation of the distance to what is surer [m].
        alone: (p,h,w) depth image of each part alone [m], +inf where it is not.
        before: (limbs,p) which parts are surer than each limb.
        rim: How many pixels around its image a part explains.
        fx: Focal length across of the images [px].
        fy: The same down.
        cx: Column of their principal point [px].
        cy: Row of it.
    """
    parts, h, w = alone.shape
    share = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        z = points[i, 2]
        u = min(max(int(np.rint(fx * points[i, 0] / z + cx)), 0), w - 1)
        v = min(max(int(np.rint(fy * points[i, 1] / z + cy)), 0), h - 1)
        surer = np.inf
        for part in range(parts):
            if not before[limb[i], part]:
                continue
            for y in range(max(v - rim, 0), min(v + rim + 1, h)):
                for x in range(max(u - rim, 0), min(u + rim + 1, w)):
                    surer = min(surer, alone[part, y, x])
        apart = (surer - z) / sigma[i]
        share[i] = 1.0 - np.exp(-0.5 * apart * apart)
    return share
