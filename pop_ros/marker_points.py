"""Points of a stored visualization_msgs/Marker as one array, without an object for each.

Both ROS versions store the same fields up to the points: header, ns, id, type, action, pose,
scale, color, lifetime, frame_locked. ROS 2 (CDR) aligns every number to its size, ROS 1 does not
and has a sequence number in front.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

STAMP, IDS, POSE_AND_SCALE, COLOR_LIFETIME_LOCKED = 8, 12, 80, 25
POINT = 24


@dataclass(frozen=True, slots=True)
class MarkerLayout:
    """How a ROS version stores a marker.

    Args:
        start: Bytes before the stamp.
        is_aligned: Whether numbers stand at multiples of their size, counted from `start`.
    """

    start: int
    is_aligned: bool

    def align(self, at: int, size: int) -> int:
        """Return where a number of a size stands that comes at `at` or behind."""
        return at + (self.start - at) % size if self.is_aligned else at


CDR = MarkerLayout(start=4, is_aligned=True)
ROS1 = MarkerLayout(start=4, is_aligned=False)


def take_points(
    data: bytes, layout: MarkerLayout
) -> tuple[bytes, Float[np.ndarray, 'n 3']] | None:
    """Return a stored marker with only its first point, and all its points [m].

    None if there is no point, or not as many as the marker says.
    """
    count_at, first = _place(data, layout)
    if first + POINT > len(data):
        return None
    count, = struct.unpack_from('<I', data, count_at)
    end = first + POINT * count
    if not count or end > len(data):
        return None
    points = np.frombuffer(data, '<f8', 3 * count, first).reshape(-1, 3)
    one = struct.pack('<I', 1)
    return data[:count_at] + one + data[count_at + 4: first + POINT] + data[end:], points


def put_points(data: bytes, points: Float[np.ndarray, 'n 3'], layout: MarkerLayout) -> bytes:
    """Return a stored marker of one point with other points [m] in its place."""
    count_at, first = _place(data, layout)
    body = np.ascontiguousarray(points, '<f8').tobytes()
    count = struct.pack('<I', len(points))
    return b''.join(
        [data[:count_at], count, data[count_at + 4: first], body, data[first + POINT:]])


def _place(data: bytes, layout: MarkerLayout) -> tuple[int, int]:
    """Return where the number of points and the first point stand."""
    at = layout.start + STAMP
    for _ in ('frame_id', 'ns'):
        at = layout.align(at, 4)
        if at + 4 > len(data):
            return len(data), len(data)
        length, = struct.unpack_from('<I', data, at)
        at += 4 + length
    at = layout.align(at, 4) + IDS
    at = layout.align(at, 8) + POSE_AND_SCALE + COLOR_LIFETIME_LOCKED
    at = layout.align(at, 4)
    return at, layout.align(at + 4, 8)
