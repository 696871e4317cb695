"""Numba kernels of point-to-plane pairs: their weights, and one pair for all of a vertex."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def plane_pairs(
    vertex, target, worth, sigma, skin_sigma, scale, vertices, normals, cloth,
):
    """Return (direction, target, weight) of point-to-plane pairs, weighted by cos / sigma^2.

    The sensor sees cloth; the body lies under it. The middle of the robust kernel (Geman and
    McClure 1987) is there, too: about the skin itself, noise would draw the body in.

    Args:
        vertex: (n) index of each pair's vertex.
        target: (n,3) measured point [m].
        worth: (n) what else multiplies the weight.
        sigma: (n) noise of the measured depth along the ray [m].
        skin_sigma: What no point is surer than [m].
        scale: Scale of the robust kernel [m].
        vertices: (m,3) of the body [m].
        normals: (m,3) of all vertices.
        cloth: (m) how far under the measured surface each vertex lies [m].
    """
    n = vertex.shape[0]
    direction, skin, weight = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    for i in range(n):
        j = vertex[i]
        x, y, z = target[i, 0], target[i, 1], target[i, 2]
        along = x * normals[j, 0] + y * normals[j, 1] + z * normals[j, 2]
        cosine = min(max(-along / np.sqrt(x * x + y * y + z * z), 0.1), 1.0)
        weight[i] = worth[i] / n * cosine / (skin_sigma**2 + (cosine * sigma[i]) ** 2)
        off = 0.0
        for c in range(3):
            direction[i, c] = normals[j, c]
            skin[i, c] = target[i, c] - cloth[j] * normals[j, c]
            off += (skin[i, c] - vertices[j, c]) ** 2
        weight[i] *= (scale**2 / (scale**2 + off)) ** 2
    return direction, skin, weight


@njit(cache=True, nogil=True)
def offsets(vertices, vertex, direction, target):
    """Return direction . (vertices[vertex] - target) of every pair (n) [m]."""
    out = np.zeros(vertex.shape[0])
    for i in range(vertex.shape[0]):
        for c in range(3):
            out[i] += direction[i, c] * (vertices[vertex[i], c] - target[i, c])
    return out


@njit(cache=True, nogil=True)
def _means(vertex, target, weight):
    """Return (first, row, mean, total) of the vertices whose pairs weigh anything.

    The first pair of each, the row of every pair's vertex among them (-1: weighs nothing), the
    weighted mean of each one's targets and the sum of its weights.
    """
    n = vertex.shape[0]
    row_of = np.full(vertex.max() + 1, -1)
    first, row = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    count = 0
    for i in range(n):
        if weight[i] > 0.0 and row_of[vertex[i]] < 0:
            row_of[vertex[i]] = count
            first[count] = i
            count += 1
    mean, total = np.zeros((count, 3)), np.zeros(count)
    for i in range(n):
        row[i] = row_of[vertex[i]]
        if weight[i] > 0.0:
            total[row[i]] += weight[i]
            for c in range(3):
                mean[row[i], c] += weight[i] * target[i, c]
    for k in range(count):
        for c in range(3):
            mean[k, c] /= total[k]
    return first[:count], row, mean, total


@njit(cache=True, nogil=True)
def merge(vertex, direction, target, weight):
    """Return (vertex, direction, target, weight) of one pair per vertex, and what it costs less.

    Targets are weighted means, weights sums; vertices without any weight are left out. Directions
    are those of a vertex's first pair: they must be the same for all of them.
    """
    first, row, mean, total = _means(vertex, target, weight)
    spread = 0.0
    for i in range(vertex.shape[0]):
        if weight[i] > 0.0:
            apart = 0.0
            for c in range(3):
                apart += direction[i, c] * (target[i, c] - mean[row[i], c])
            spread += 0.5 * weight[i] * apart * apart
    return vertex[first], direction[first], mean, total, spread


@njit(cache=True, nogil=True)
def merge_axes(vertex, target, weight):
    """Return `merge` of pairs that pull along x, y and z alike: three rows per vertex."""
    first, row, mean, total = _means(vertex, target, weight)
    spread = 0.0
    for i in range(vertex.shape[0]):
        if weight[i] > 0.0:
            for c in range(3):
                spread += 0.5 * weight[i] * (target[i, c] - mean[row[i], c]) ** 2
    count = first.shape[0]
    out_vertex, axis = np.empty(3 * count, dtype=np.int64), np.zeros((3 * count, 3))
    out_target, out_weight = np.empty((3 * count, 3)), np.empty(3 * count)
    for k in range(3 * count):
        out_vertex[k], out_weight[k] = vertex[first[k % count]], total[k % count]
        out_target[k] = mean[k % count]
        axis[k, k // count] = 1.0
    return out_vertex, axis, out_target, out_weight, spread
