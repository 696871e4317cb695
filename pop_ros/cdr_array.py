"""Serialise a MarkerArray whose meshes are large without building their Point objects.

The array is serialised with one sentinel point in place of each mesh; then the points are put
there. Points are 24 bytes, a multiple of every alignment, so that what follows stays aligned.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point
from jaxtyping import Float
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from pop_ros.cdr import LITTLE_ENDIAN, SENTINEL, TEST_POINTS

Points = Float[np.ndarray, 'n 3']
SENTINEL_BYTES = struct.pack('<3d', *SENTINEL)
ONE = struct.pack('<I', 1)


class ArrayWriter:
    """Makes marker arrays as bytes where the installed messages allow it, else as objects."""

    def __init__(self) -> None:
        """Check the way of bytes once."""
        self.is_fast = _agrees()

    def message(
        self, markers: Sequence[Marker], meshes: Sequence[tuple[Marker, Points]]
    ) -> MarkerArray | bytes:
        """Return an array of small markers, and of markers with their points [m]."""
        if self.is_fast:
            found = as_bytes(markers, meshes)
            if found is not None:
                return found
        return as_object(markers, meshes)


def as_bytes(
    markers: Sequence[Marker], meshes: Sequence[tuple[Marker, Points]]
) -> bytes | None:
    """Return the serialised array; None if a sentinel does not stand where it is expected."""
    x, y, z = SENTINEL
    for marker, _ in meshes:
        marker.points = [Point(x=x, y=y, z=z)]
    data = bytes(serialize_message(MarkerArray(markers=[*(m for m, _ in meshes), *markers])))
    if data[1] != LITTLE_ENDIAN:
        return None
    parts, start = [], 0
    for _, points in meshes:
        at = data.find(SENTINEL_BYTES, start)
        if at < 0 or data[at - len(ONE): at] != ONE:
            return None
        body = np.ascontiguousarray(points, dtype='<f8').tobytes()
        parts += [data[start: at - len(ONE)], struct.pack('<I', len(points)), body]
        start = at + len(SENTINEL_BYTES)
    return b''.join([*parts, data[start:]])


def as_object(
    markers: Sequence[Marker], meshes: Sequence[tuple[Marker, Points]]
) -> MarkerArray:
    """Return the array as the message itself; slow for large meshes."""
    for marker, points in meshes:
        marker.points = [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]
    return MarkerArray(markers=[*(m for m, _ in meshes), *markers])


def _agrees() -> bool:
    """Return whether the installed MarkerArray reads the bytes as what was meant."""
    def parts() -> tuple[list[Marker], list[tuple[Marker, Points]]]:
        meshes = [(Marker(ns=ns, id=k), TEST_POINTS + k) for k, ns in enumerate(('a', 'mesh'))]
        return [Marker(ns='bones', text='7')], meshes

    found = as_bytes(*parts())
    if found is None:
        return False
    try:
        return bool(deserialize_message(found, MarkerArray) == as_object(*parts()))
    except RuntimeError:  # what rclpy raises for bytes that are no MarkerArray
        return False
