"""Numba kernels of lifting: depth layers of a patch, and joint depths on the skeleton tree."""

from __future__ import annotations

import numpy as np
from numba import njit

MAX_LAYERS = 4


@njit(cache=True, nogil=True)
def patch_layers(depth, own, u0, v0, radius, gap_ratio, layers):
    """Fill layers (4, 4) with (depth, share, spread, own share) of surfaces near a pixel.

    Depths are sorted and cut where neighbours differ by more than gap_ratio times their depth.
    Pixels count by a Gaussian of the distance to (u0, v0). Returns the number of layers kept,
    those of the largest shares.
    """
    h, w = depth.shape
    left, right = max(0, int(np.ceil(u0 - radius))), min(w - 1, int(np.floor(u0 + radius)))
    top, bottom = max(0, int(np.ceil(v0 - radius))), min(h - 1, int(np.floor(v0 + radius)))
    size = max(0, right - left + 1) * max(0, bottom - top + 1)
    z = np.empty(size)
    weight = np.empty(size)
    mine = np.empty(size)
    n = 0
    total = 0.0
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            d2 = ((x - u0) ** 2 + (y - v0) ** 2) / (radius * radius)
            if d2 > 1.0:
                continue
            g = np.exp(-2.0 * d2)
            total += g
            value = depth[y, x]
            if np.isnan(value):
                continue
            z[n], weight[n] = value, g
            mine[n] = g if own[y, x] else 0.0
            n += 1
    layers[:] = 0.0
    if n == 0:
        return 0
    order = np.argsort(z[:n])
    kept = 0
    start = 0
    for i in range(1, n + 1):
        if i < n and z[order[i]] - z[order[i - 1]] <= gap_ratio * z[order[i]]:
            continue
        kept = _keep_layer(z, weight, mine, order[start:i], total, layers, kept)
        start = i
    return kept


@njit(cache=True, nogil=True)
def _keep_layer(z, weight, mine, members, total, layers, kept):
    """Add one layer, in place of the smallest when there is no room; return how many there are."""
    share = 0.0
    own = 0.0
    for i in members:
        share += weight[i]
        own += mine[i]
    place = kept
    if kept == MAX_LAYERS:
        place = np.argmin(layers[:, 1])
        if layers[place, 1] >= share / total:
            return kept
    # Quantiles by weight: on the floor around an ankle, the middle of the patch is what counts.
    below = 0.0
    first, middle, third = np.nan, np.nan, np.nan
    for i in members:
        below += weight[i] / share
        if np.isnan(first) and below >= 0.25:
            first = z[i]
        if np.isnan(middle) and below >= 0.5:
            middle = z[i]
        if below >= 0.75:
            third = z[i]
            break
    layers[place, 0] = middle
    layers[place, 1] = share / total
    layers[place, 2] = 0.5 * (third - first) * 1.4826
    layers[place, 3] = own / share
    return min(kept + 1, MAX_LAYERS)


@njit(cache=True, nogil=True)
def approach(depth, u0, v0, u1, v1, jump_ratio):
    """Return how far the surface jumps toward the camera between two pixels [m].

    Smooth changes count nothing: a limb pointing at the camera approaches without a jump, and a
    hand passed on the way jumps near and far again.
    """
    h, w = depth.shape
    steps = int(np.ceil(max(abs(u1 - u0), abs(v1 - v0), 1.0)))
    last = np.nan
    total = 0.0
    for i in range(steps + 1):
        x = int(np.rint(u0 + (u1 - u0) * i / steps))
        y = int(np.rint(v0 + (v1 - v0) * i / steps))
        if x < 0 or y < 0 or x >= w or y >= h or np.isnan(depth[y, x]):
            continue
        z = depth[y, x]
        if not np.isnan(last) and abs(z - last) > jump_ratio * min(z, last):
            total += last - z
        last = z
    return total
