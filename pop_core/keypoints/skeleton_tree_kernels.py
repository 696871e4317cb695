"""Numba kernels of joint depths: bones against the depth image, the best depths on a tree."""

from __future__ import annotations

import numpy as np
from numba import njit

EXCUSED = 4.0  # multiples of the tolerance beyond which a length is broken without a closer look


@njit(cache=True, nogil=True)
def bone_samples(depth, u0, v0, u1, v1, aside_px, out):
    """Fill out (n, 3) with the depth on and beside the line between two pixels [m].

    Row i lies at the share (i + 1) / (n + 1) of the way; the columns lie on the line and
    `aside_px` to either side of it. NaN outside the image and where nothing was measured.
    """
    h, w = depth.shape
    length = max(np.hypot(u1 - u0, v1 - v0), 1e-9)
    across_u, across_v = -(v1 - v0) / length * aside_px, (u1 - u0) / length * aside_px
    n = len(out)
    for i in range(n):
        share = (i + 1.0) / (n + 1.0)
        for k in range(3):
            side = 0.0 if k == 0 else 3.0 - 2.0 * k
            x = int(np.rint(u0 + share * (u1 - u0) + side * across_u))
            y = int(np.rint(v0 + share * (v1 - v0) + side * across_v))
            inside = 0 <= x < w and 0 <= y < h
            out[i, k] = depth[y, x] if inside else np.nan


@njit(cache=True, nogil=True)
def bone_cost(samples, from_m, to_m, from_skin_m, to_skin_m, costs):
    """Return the cost of what was measured along a bone between two depths.

    `costs` are those of a bone in empty space, behind another surface and where nothing was
    measured, then the slack and the softness of the skin's place [m].
    """
    empty, behind, unknown, slack, soft = costs
    n = len(samples)
    total = 0.0
    for i in range(n):
        share = (i + 1.0) / (n + 1.0)
        # Inverse depth is linear along a line in the image.
        z = from_m * to_m / ((1.0 - share) * to_m + share * from_m)
        skin = z - (1.0 - share) * from_skin_m - share * to_skin_m
        lowest = np.inf
        for k in range(3):
            gap = samples[i, k] - skin
            if np.isnan(gap):
                continue
            over = min(max(abs(gap) - slack, 0.0) / soft, 1.0)
            lowest = min(lowest, over * (empty if gap > 0 else behind))
        total += lowest if lowest < np.inf else unknown
    return total / n


@njit(cache=True, nogil=True)
def tree_depths(
    unary, bins, rays, links, order, limits, tolerance, worst, samples, skin_m, costs, out
):
    """Fill out (n) with the bin of each joint that minimises unary and bone costs on the tree.

    A link costs 0.5 (x / tolerance)^2 when it is too long or too short by x, 0.5 (dz / lean)^2
    for the depth dz along it, and what `bone_cost` says; `worst` at most. Exact by dynamic
    programming, leaves first.

    Args:
        unary: Cost of each joint at each bin (n, m).
        bins: Depth of each bin [m], evenly spaced.
        rays: (x/z, y/z) of each joint (n, 2).
        links: The joint that each hangs on, -1 for the root and for joints left out.
        order: Joints to choose for, each after the one it hangs on.
        limits: Shortest and longest distance from each joint to the one it hangs on, and the
            standard deviation of the depth between them [m] (n, 3).
        tolerance: Softness of the lengths [m].
        worst: Most that a broken bone costs.
        samples: Depth along each link [m] (n, p, 3).
        skin_m: Distance of each joint from the skin before it [m].
        costs: Of `bone_cost`, for each link (n, 5).
        out: Chosen bins, filled for the joints in `order`.
    """
    n, m = unary.shape
    step = bins[1] - bins[0]
    cost = unary.copy()
    best = np.zeros((n, m), dtype=np.int64)
    for at in range(len(order) - 1, 0, -1):
        j = order[at]
        parent = links[j]
        shortest, longest, lean = limits[j]
        lowest = int(np.argmin(cost[j]))
        fallback = cost[j, lowest] + worst
        seen = costs[j, :3].max() > 0.0
        band = int(np.ceil((longest + EXCUSED * tolerance) / step))
        for b in range(m):
            smallest, chosen = fallback, lowest
            for a in range(max(0, b - band), min(m, b + band + 1)):
                if cost[j, a] >= smallest:
                    continue
                dz = bins[a] - bins[b]
                dx = rays[j, 0] * bins[a] - rays[parent, 0] * bins[b]
                dy = rays[j, 1] * bins[a] - rays[parent, 1] * bins[b]
                length = np.sqrt(dx * dx + dy * dy + dz * dz)
                excess = max(0.0, length - longest, shortest - length) / tolerance
                slope = dz / lean
                link = 0.5 * excess * excess + 0.5 * slope * slope
                if seen and cost[j, a] + link < smallest and link < worst:
                    link += bone_cost(
                        samples[j], bins[b], bins[a], skin_m[parent], skin_m[j], costs[j])
                if cost[j, a] + min(link, worst) < smallest:
                    smallest, chosen = cost[j, a] + min(link, worst), a
            best[j, b] = chosen
            cost[parent, b] += smallest
    root = order[0]
    out[root] = np.argmin(cost[root])
    for at in range(1, len(order)):
        j = order[at]
        out[j] = best[j, out[links[j]]]
