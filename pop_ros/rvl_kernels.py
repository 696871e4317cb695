"""RVL, the lossless depth coding of compressedDepth (Wilson 2017), decoded by numba."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def decode_rvl(nibbles: np.ndarray, depth: np.ndarray) -> int:
    """Fill `depth` (flat uint16) from 4-bit words; return the pixels that were written.

    Runs of zeros and of differences alternate; every number is coded in groups of three bits,
    least significant first, the fourth bit telling that another group follows.
    """
    position, pixel, previous = 0, 0, 0
    while pixel < depth.size:
        zeros, position = _number(nibbles, position)
        values, position = _number(nibbles, position)
        if position < 0 or pixel + zeros + values > depth.size:
            return pixel
        depth[pixel: pixel + zeros] = 0
        pixel += zeros
        for _ in range(values):
            zigzag, position = _number(nibbles, position)
            if position < 0:
                return pixel
            previous += (zigzag >> 1) ^ -(zigzag & 1)
            depth[pixel] = previous
            pixel += 1
        if zeros == 0 and values == 0:
            return pixel
    return pixel


@njit(cache=True, nogil=True)
def _number(nibbles: np.ndarray, position: int) -> tuple[int, int]:
    """Return a number and the position behind it, -1 when the data ends before."""
    value, shift = 0, 0
    while 0 <= position < nibbles.size and shift < 32:
        nibble = int(nibbles[position])
        position += 1
        value |= (nibble & 7) << shift
        if nibble & 8 == 0:
            return value, position
        shift += 3
    return 0, -1
