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


# Innermost loops go over depths without branches or checks: processors do several at once.
@njit(cache=True, nogil=True, error_model='numpy')
def add_bone_costs(samples, from_m, to_m, from_skin_m, to_skin_m, costs, out):
    """Add to out (m) the cost of what was measured along a bone, for m depths of its end.

    `costs` are those of a bone in empty space, behind another surface and where nothing was
    measured, then the slack and the softness of the skin's place [m].
    """
    empty, behind, unknown, slack, soft = costs
    n = len(samples)
    empty, behind, unknown = empty / n, behind / n, unknown / n
    per_empty, per_behind = empty / soft, behind / soft
    for i in range(n):
        share = (i + 1.0) / (n + 1.0)
        keep, part = 1.0 - share, share * from_m
        cover = keep * from_skin_m + share * to_skin_m
        # Where a bone's surface would have to be for these to be its skin.
        near, left, right = samples[i, 0] + cover, samples[i, 1] + cover, samples[i, 2] + cover
        if np.isnan(near):
            near = right if np.isnan(left) else left
        if np.isnan(near):
            out += unknown
            continue
        left = near if np.isnan(left) else left
        right = near if np.isnan(right) else right
        for a in range(len(to_m)):
            # Inverse depth is linear along a line in the image.
            z = from_m * to_m[a] / (keep * to_m[a] + part)
            cost = _ramp(near - z, slack, empty, per_empty, behind, per_behind)
            other = _ramp(left - z, slack, empty, per_empty, behind, per_behind)
            cost = cost if cost < other else other
            other = _ramp(right - z, slack, empty, per_empty, behind, per_behind)
            cost = cost if cost < other else other
            out[a] += cost


@njit(cache=True, nogil=True, inline='always')
def _ramp(gap, slack, empty, per_empty, behind, per_behind):
    """Return what a surface this far behind a bone's skin [m] costs; in front if negative."""
    cost = (gap - slack) * per_empty if gap > 0.0 else (-gap - slack) * per_behind
    most = empty if gap > 0.0 else behind
    cost = cost if cost < most else most
    return cost if cost > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model='numpy')
def length_costs(from_m, to_m, from_ray, to_ray, limits, tolerance, out):
    """Fill out (m) with the cost of the length and lean of a bone, for m depths of its end."""
    shortest, longest, lean = limits
    x, y = from_ray[0] * from_m, from_ray[1] * from_m
    for a in range(len(to_m)):
        dz = to_m[a] - from_m
        dx, dy = to_ray[0] * to_m[a] - x, to_ray[1] * to_m[a] - y
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        excess = length - longest if length - longest > shortest - length else shortest - length
        excess = (excess if excess > 0.0 else 0.0) / tolerance
        out[a] = 0.5 * excess * excess + 0.5 * (dz / lean) * (dz / lean)


@njit(cache=True, nogil=True)
def tree_depths(
    unary, bins, rays, links, order, limits, tolerance, worst, samples, skin_m, costs, out
):
    """Fill out (n) with the bin of each joint that minimises unary and bone costs on the tree.

    A link costs 0.5 (x / tolerance)^2 when it is too long or too short by x, 0.5 (dz / lean)^2
    for the depth dz along it, and what `add_bone_costs` says; `worst` at most. Exact by dynamic
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
        costs: Of `add_bone_costs`, for each link (n, 5).
        out: Chosen bins, filled for the joints in `order`.
    """
    n, m = unary.shape
    step = bins[1] - bins[0]
    cost = unary.copy()
    best = np.zeros((n, m), dtype=np.int64)
    link = np.empty(m)
    for at in range(len(order) - 1, 0, -1):
        j = order[at]
        parent = links[j]
        lowest = int(np.argmin(cost[j]))
        fallback = cost[j, lowest] + worst
        seen = costs[j, :3].max() > 0.0
        band = int(np.ceil((limits[j, 1] + EXCUSED * tolerance) / step))
        for b in range(m):
            first, last = max(0, b - band), min(m, b + band + 1)
            near, there = bins[first:last], link[first:last]
            length_costs(bins[b], near, rays[parent], rays[j], limits[j], tolerance, there)
            if seen:
                add_bone_costs(
                    samples[j], bins[b], near, skin_m[parent], skin_m[j], costs[j], there)
            smallest, chosen = fallback, lowest
            for a in range(first, last):
                total = cost[j, a] + min(link[a], worst)
                if total < smallest:
                    smallest, chosen = total, a
            best[j, b] = chosen
            cost[parent, b] += smallest
    root = order[0]
    out[root] = np.argmin(cost[root])
    for at in range(1, len(order)):
        j = order[at]
        out[j] = best[j, out[links[j]]]
