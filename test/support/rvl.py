"""An encoder of RVL, the compression of depth, as slow and as plain as its description."""

import struct

import numpy as np


def encode_rvl(depth: np.ndarray) -> bytes:
    """Encode uint16 depth pixel by pixel, as the format's author describes it."""
    nibbles: list[int] = []

    def put(value: int) -> None:
        while True:
            low, value = value & 7, value >> 3
            nibbles.append(low | (8 if value else 0))
            if not value:
                return

    flat, i, previous = depth.ravel().tolist(), 0, 0
    while i < len(flat):
        start = i
        while i < len(flat) and flat[i] == 0:
            i += 1
        put(i - start)
        start = i
        while i < len(flat) and flat[i] != 0:
            i += 1
        put(i - start)
        for value in flat[start:i]:
            delta = value - previous
            put((delta << 1) ^ (delta >> 31))
            previous = value
    nibbles += [0] * (-len(nibbles) % 8)
    words = [sum(n << (28 - 4 * k) for k, n in enumerate(nibbles[j:j + 8]))
             for j in range(0, len(nibbles), 8)]
    height, width = depth.shape
    return struct.pack('<ii', width, height) + struct.pack(f'<{len(words)}I', *words)
