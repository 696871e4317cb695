"""Numba kernels of the segment of a body: what is near the rendered one, and connected to it."""

from __future__ import annotations

import numpy as np
from numba import njit

from pop_core.geometry.nearest_pixel_kernels import nearest_pixel, nearest_rows


@njit(cache=True, nogil=True)
def _listed(mask):
    """Return the pixels (y, x) of a mask, with room for all others behind them, and how many."""
    h, w = mask.shape
    queue = np.empty((h * w, 2), dtype=np.int32)
    count = 0
    for y in range(h):
        for x in range(w):
            if mask[y, x]:
                queue[count, 0], queue[count, 1] = y, x
                count += 1
    return queue, count


@njit(cache=True, nogil=True)
def _beside(y, x, k):
    """Return the pixel below, above, to the right or to the left of one, for k of 0 to 3."""
    return (y + (1 if k == 0 else -1 if k == 1 else 0),
            x + (1 if k == 2 else -1 if k == 3 else 0))


@njit(cache=True, nogil=True)
def _may_join(y, x, inside, allowed):
    """Return whether a pixel is one of the image, allowed, and not inside yet."""
    h, w = inside.shape
    return 0 <= y < h and 0 <= x < w and not inside[y, x] and allowed[y, x]


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
    queue, tail = _listed(out)
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        for k in range(4):
            ny, nx = _beside(y, x, k)
            if not _may_join(ny, nx, out, own):
                continue
            noise = _noise(depth[y, x], blur, blur_per_square, tolerance)
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
    queue, tail = _listed(inside)
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        for k in range(4):
            ny, nx = _beside(y, x, k)
            if not _may_join(ny, nx, inside, allowed):
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
    queue, tail = _listed(inside)
    head = 0
    while head < tail:
        y, x = queue[head, 0], queue[head, 1]
        head += 1
        here = depth[y, x]
        for k in range(4):
            ny, nx = _beside(y, x, k)
            if not _may_join(ny, nx, inside, allowed):
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
