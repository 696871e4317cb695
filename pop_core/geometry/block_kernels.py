"""Numba kernels of symmetric matrices and 3x3 blocks on a diagonal."""

from __future__ import annotations

from numba import njit


@njit(cache=True, nogil=True)
def sandwich(matrix, blocks, first):
    """Return S' M S of a symmetric matrix (n,n); S is the unit matrix but for blocks (k,3,3).

    A ninth of the work of two products with all of S, or less.

    Args:
        matrix: M.
        blocks: What S has on its diagonal, one after the other.
        first: The row where they begin.
    """
    n, k = matrix.shape[0], blocks.shape[0]
    half = matrix.copy()
    for j in range(k):
        row = first + 3 * j
        for c in range(3):
            a, b, d = blocks[j, 0, c], blocks[j, 1, c], blocks[j, 2, c]
            for x in range(n):
                half[row + c, x] = (
                    a * matrix[row, x] + b * matrix[row + 1, x] + d * matrix[row + 2, x])
    out = half.copy()
    for x in range(n):
        for j in range(k):
            column = first + 3 * j
            for c in range(3):
                out[x, column + c] = (
                    half[x, column] * blocks[j, 0, c] + half[x, column + 1] * blocks[j, 1, c]
                    + half[x, column + 2] * blocks[j, 2, c])
    return out
