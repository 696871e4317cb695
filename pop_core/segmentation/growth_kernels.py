"""Numba kernels of the segment of a body: what is near the rendered one, and connected to it."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.geometry.nearest_pixel_kernels import nearest_pixel, nearest_rows

# From a pixel to those below, above, to the right and to the left of it.
DOWN, ACROSS = (1, -1, 0, 0), (0, 0, 1, -1)


@njit(cache=True, nogil=True)
def _rim(mask, allowed):
    """Return the pixels (y, x) of a mask beside which others may join, and how many these are.

    There is room for all others behind them. Each of the four neighbours is asked for by itself,
    since a loop over them takes far longer.
    """
    h, w = mask.shape
    queue = np.empty((h * w, 2), dtype=np.int32)
    count = 0
    for y in range(h):
        for x in range(w):
            if mask[y, x] and (
                    (y > 0 and allowed[y - 1, x] and not mask[y - 1, x])
                    or (y < h - 1 and allowed[y + 1, x] and not mask[y + 1, x])
                    or (x > 0 and allowed[y, x - 1] and not mask[y, x - 1])
                    or (x < w - 1 and allowed[y, x + 1] and not mask[y, x + 1])):
                queue[count, 0], queue[count, 1] = y, x
                count += 1
    return queue, count


@njit(cache=True, nogil=True)
def _noise(z, blur, blur_per_square, most):
    """Return what noise may add at a depth [m]."""
    return min(blur + blur_per_square * z * z, most)


@njit(cache=True, nogil=True)
def segment(depth, rendered, own, gamma, tolerance, blur, blur_per_square, growth, nearest, out):
    """Fill `out` with the measured pixels of a body: those it covers, and the rim joined to them.

    Args:
        depth: (h,w) measured depth [m].
        rendered: (h,w) depth of the body alone [m], +inf where it is not.
        own: (h,w) pixels that may be the person's.
        gamma: Depth step that is still one surface [m].
        tolerance: Distance from the body's depth that is still the body [m].
        blur: What noise adds to both, no more than the tolerance itself [m].
        blur_per_square: Growth of it with the square of depth [1/m].
        growth: How wide the rim is [m px]: over depth, a number of pixels.
        nearest: Depth that nobody is nearer than [m].
        out: (h,w), all false.
    """
    h, w = depth.shape
    row = nearest_rows(rendered < np.inf)
    farthest = growth / max(rendered.min(), nearest)
    for y in range(h):
        for x in range(w):
            out[y, x] = (
                rendered[y, x] != np.inf and own[y, x]
                and abs(depth[y, x] - rendered[y, x])
                < tolerance + _noise(depth[y, x], blur, blur_per_square, tolerance))
    queue, tail = _rim(out, own)
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        noise = _noise(depth[y, x], blur, blur_per_square, tolerance)
        for k in range(4):
            ny, nx = y + DOWN[k], x + ACROSS[k]
            if not (0 <= ny < h and 0 <= nx < w) or out[ny, nx] or not own[ny, nx]:
                continue
            if not abs(depth[ny, nx] - depth[y, x]) < gamma + noise:
                continue
            squared, body_y, body_x = nearest_pixel(row, ny, nx, farthest)
            if body_y < 0:
                continue
            body = rendered[body_y, body_x]
            reach = growth / max(body, nearest)
            if abs(depth[ny, nx] - body) < tolerance + noise and squared <= reach * reach:
                out[ny, nx] = True
                queue[tail, 0], queue[tail, 1] = ny, nx
                tail += 1


@njit(cache=True, nogil=True)
def flood(inside, allowed):
    """Add to `inside` the allowed pixels that hang together with it, side by side."""
    h, w = inside.shape
    queue, tail = _rim(inside, allowed)
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        for k in range(4):
            ny, nx = y + DOWN[k], x + ACROSS[k]
            if not (0 <= ny < h and 0 <= nx < w) or inside[ny, nx] or not allowed[ny, nx]:
                continue
            inside[ny, nx] = True
            queue[tail, 0], queue[tail, 1] = ny, nx
            tail += 1


@njit(cache=True, nogil=True)
def creep(inside, allowed, depth, step, step_per_square, centres, reach, fx, fy, cx, cy):
    """Add to `inside` what hangs together with it by small steps of depth, within reach.

    Args:
        inside: (h,w) pixels to begin with.
        allowed: (h,w) pixels that may join.
        depth: (h,w) measured depth [m].
        step: Most depth between neighbours [m].
        step_per_square: Growth of it with the square of depth [1/m].
        centres: (k,3) points, camera frame [m].
        reach: (k) how far from each of them a pixel may lie [m].
        fx: Focal length across [px].
        fy: The same down.
        cx: Column of the principal point [px].
        cy: Row of it.
    """
    h, w = inside.shape
    queue, tail = _rim(inside, allowed)
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        here = depth[y, x]
        for k in range(4):
            ny, nx = y + DOWN[k], x + ACROSS[k]
            if not (0 <= ny < h and 0 <= nx < w) or inside[ny, nx] or not allowed[ny, nx]:
                continue
            z = depth[ny, nx]
            if not abs(z - here) < step + step_per_square * here * here:
                continue
            near = False
            for c in range(len(reach)):
                dx = (nx - cx) / fx * z - centres[c, 0]
                dy = (ny - cy) / fy * z - centres[c, 1]
                dz = z - centres[c, 2]
                near |= dx * dx + dy * dy + dz * dz < reach[c] * reach[c]
            if near:
                inside[ny, nx] = True
                queue[tail, 0], queue[tail, 1] = ny, nx
                tail += 1
