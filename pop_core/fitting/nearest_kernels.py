"""Numba kernels of exact nearest neighbours between a measured surface and a mesh.

Both are thin in depth, so a grid over x and y finds a neighbour in a handful of comparisons. A
tree takes three times as long, most of it to be built for a single query.
"""

from __future__ import annotations

import numpy as np
from numba import njit

CELL_M = 0.05
MOST_CELLS = 256  # along an axis: a place far off makes cells larger, not more


@njit(cache=True, nogil=True)
def shrunk(p_camera, middle_m, shrink, nearest_m):
    """Return points (n,3) [m] at coordinates in which distances along rays are shrunk.

    Distances across rays keep their length at depth middle_m; nothing is nearer than nearest_m.
    """
    out = np.empty(p_camera.shape)
    for i in range(p_camera.shape[0]):
        widen = middle_m / max(p_camera[i, 2], nearest_m)
        out[i, 0], out[i, 1] = p_camera[i, 0] * widen, p_camera[i, 1] * widen
        out[i, 2] = shrink * p_camera[i, 2]
    return out


@njit(cache=True, nogil=True)
def _grid(places):
    """Return corner, size of a cell, cells along y, first place of each cell, and their order."""
    x0, y0, x1, y1 = np.inf, np.inf, -np.inf, -np.inf
    for i in range(places.shape[0]):
        x0, x1 = min(x0, places[i, 0]), max(x1, places[i, 0])
        y0, y1 = min(y0, places[i, 1]), max(y1, places[i, 1])
    cell = max(CELL_M, max(x1 - x0, y1 - y0) / MOST_CELLS)
    columns, rows = int((x1 - x0) / cell) + 1, int((y1 - y0) / cell) + 1
    cell_of = np.empty(places.shape[0], dtype=np.int64)
    first = np.zeros(columns * rows + 1, dtype=np.int64)
    for i in range(places.shape[0]):
        column, row = int((places[i, 0] - x0) / cell), int((places[i, 1] - y0) / cell)
        cell_of[i] = row * columns + column
        first[cell_of[i] + 1] += 1
    for c in range(columns * rows):
        first[c + 1] += first[c]
    order = np.empty(places.shape[0], dtype=np.int64)
    free = first[:-1].copy()
    for i in range(places.shape[0]):
        order[free[cell_of[i]]] = i
        free[cell_of[i]] += 1
    return x0, y0, cell, columns, rows, first, order


@njit(cache=True, nogil=True, inline='always')  # the call would cost as much as its loop
def _nearest_of(begin, end, places, x, y, z, best, found):
    """Return squared distance and row of the nearest so far, some cells of a row looked at."""
    for k in range(begin, end):
        dx, dy, dz = places[k, 0] - x, places[k, 1] - y, places[k, 2] - z
        d = dx * dx + dy * dy + dz * dz
        if d < best:
            best, found = d, k
    return best, found


@njit(cache=True, nogil=True)
def nearest(points, places):
    """Return index and distance [m] of the nearest of places (m,3) to each point (n,3).

    All must be finite, and at least one place be given.
    """
    x0, y0, cell, columns, rows, first, order = _grid(places)
    places = places[order]  # those of a cell beside each other
    index = np.empty(points.shape[0], dtype=np.int64)
    distance = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        column, row = int(np.floor((x - x0) / cell)), int(np.floor((y - y0) / cell))
        best, found = np.inf, -1
        # Rings of cells around the point's own, which may lie outside of the grid.
        ring = max(-column, column - columns + 1, -row, row - rows + 1, 0)
        last = max(column, columns - 1 - column, row, rows - 1 - row)
        # What lies in farther rings is at least as far off as these are wide.
        while ring <= last and best > ((ring - 1) * cell) ** 2:
            left, right = column - ring, column + ring
            for r in range(max(row - ring, 0), min(row + ring, rows - 1) + 1):
                away = max(y0 + r * cell - y, y - y0 - (r + 1) * cell, 0.0)
                if away * away >= best:
                    continue
                start = r * columns
                if abs(r - row) == ring:
                    best, found = _nearest_of(
                        first[start + max(left, 0)], first[start + min(right, columns - 1) + 1],
                        places, x, y, z, best, found)
                    continue
                if left >= 0:
                    best, found = _nearest_of(
                        first[start + left], first[start + left + 1], places, x, y, z, best,
                        found)
                if right < columns:
                    best, found = _nearest_of(
                        first[start + right], first[start + right + 1], places, x, y, z, best,
                        found)
            ring += 1
        index[i], distance[i] = order[found], np.sqrt(best)
    return index, distance
