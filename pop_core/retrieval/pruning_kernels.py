"""Numba kernels that thin out sets of poses."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def keep_apart(
    joints, keys, cells, shape, heads, links, accepted, accepted_keys, count, spacing, wanted, kept
):
    """Accept, in order, every pose that is farther than `spacing` from all accepted ones.

    Poses nearer than the spacing lie in cells that touch, so only those are looked at, and of
    these only the ones whose keys are near.

    Args:
        joints: Joints (n,s,3) float32 [m] of new poses.
        keys: Projections (n,k) float32 [m] of new poses, none steeper than the distance.
        cells: Grid cell (n,d) of each new pose.
        shape: Number of cells along each of the d axes.
        heads: Latest accepted pose of each cell (flat), -1 for none; updated.
        links: The accepted pose before each accepted one in its cell; updated.
        accepted: Joints (m,s,3) of accepted poses; filled from `count` on.
        accepted_keys: Keys (m,k) of accepted poses; filled likewise.
        count: Number of accepted poses so far.
        spacing: Smallest mean joint distance [m] of two accepted poses.
        wanted: Stop at this many accepted poses.
        kept: Filled with the rows of newly accepted poses.

    Returns:
        Number of accepted poses now.
    """
    d = shape.shape[0]
    neighbours = 3**d
    found = 0
    for i in range(joints.shape[0]):
        if count == wanted:
            break
        free = True
        for neighbour in range(neighbours):
            # The pose's own cell comes first: a near pose most often shares it.
            cell, rest, inside = 0, (neighbour + neighbours // 2) % neighbours, True
            for axis in range(d):
                place = cells[i, axis] + rest % 3 - 1
                rest //= 3
                inside = inside and 0 <= place < shape[axis]
                cell = cell * shape[axis] + place
            other = heads[cell] if inside else -1
            while other >= 0 and free:
                if _keys_near(keys[i], accepted_keys[other], spacing):
                    free = not _near(joints[i], accepted[other], spacing)
                other = links[other]
            if not free:
                break
        if not free:
            continue
        cell = 0
        for axis in range(d):
            cell = cell * shape[axis] + cells[i, axis]
        accepted[count] = joints[i]
        accepted_keys[count] = keys[i]
        links[count] = heads[cell]
        heads[cell] = count
        kept[found] = i
        found += 1
        count += 1
    return count


@njit(cache=True, nogil=True)
def nearest_distance(queries, joints, out):
    """Fill out (n) with each query's smallest mean joint distance [m] to poses (m,s,3)."""
    s = joints.shape[1]
    for i in range(queries.shape[0]):
        best = np.inf
        for m in range(joints.shape[0]):
            total = 0.0
            for k in range(s):
                x = queries[i, k, 0] - joints[m, k, 0]
                y = queries[i, k, 1] - joints[m, k, 1]
                z = queries[i, k, 2] - joints[m, k, 2]
                total += np.sqrt(x * x + y * y + z * z)
                if total >= best:
                    break
            best = min(best, total)
        out[i] = best / s


@njit(cache=True, nogil=True)
def _keys_near(a, b, spacing):
    k = 0
    while k < a.shape[0] and abs(a[k] - b[k]) <= spacing:
        k += 1
    return k == a.shape[0]


@njit(cache=True, nogil=True)
def _near(a, b, spacing):
    s = a.shape[0]
    total, limit = 0.0, spacing * s
    for k in range(s):
        x = a[k, 0] - b[k, 0]
        y = a[k, 1] - b[k, 1]
        z = a[k, 2] - b[k, 2]
        total += np.sqrt(x * x + y * y + z * z)
        if total > limit:
            return False
    return True
