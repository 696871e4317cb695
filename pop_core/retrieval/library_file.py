"""Pose library files: one header, then plain arrays that are memory-mapped.

Layout: 8 bytes of magic with the version, 8 bytes of header length, a JSON header, then the arrays
at multiples of 4096 bytes, little-endian. The header names each array's place, shape and type, and
the checksum of everything after it.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pop_core.errors import LibraryFileError
from pop_core.retrieval.pose_library import PoseLibrary

MAGIC = b'POPLIB01'
ALIGNMENT = 4096
CHUNK_BYTES = 1 << 24
ARRAYS: dict[str, np.dtype[Any]] = {
    'body_pose': np.dtype('<f4'), 'tilt': np.dtype('<f4'), 'columns': np.dtype('<f4'),
    'masks': np.dtype('<u2'), 'weights': np.dtype('<f4'),
}


@dataclass(frozen=True, slots=True)
class LibraryHeader:
    """What a library file says about itself.

    Args:
        poses: Number of poses.
        checksum: CRC-32 of everything after the header.
        notes: Origin of the poses, free text by name.
        places: Offset [bytes] and shape of each array.
    """

    poses: int
    checksum: int
    notes: Mapping[str, str]
    places: Mapping[str, tuple[int, tuple[int, ...]]]


def array_shapes(poses: int) -> dict[str, tuple[int, ...]]:
    """Return the shape of every array of a library."""
    return {
        'body_pose': (poses, 23, 3), 'tilt': (poses, 3), 'columns': (15, 3, poses),
        'masks': (poses,), 'weights': (poses,),
    }


def save_library(
    library: PoseLibrary, path: str | Path, notes: Mapping[str, str] | None = None
) -> None:
    """Write a library so that a reader never sees half a file."""
    with new_library_file(Path(path), len(library), notes or {}) as arrays:
        for name in ARRAYS:
            arrays[name][...] = getattr(library, name)


class new_library_file:  # noqa: N801 - used as a function, like open()
    """Context of writable memory-mapped arrays; the file takes its name when it is complete."""

    def __init__(self, path: Path, poses: int, notes: Mapping[str, str]) -> None:
        """Plan a file for a number of poses."""
        self.path, self.poses, self.notes = path, poses, dict(notes)
        self.partial = path.with_name(f'{path.name}.{os.getpid()}.part')

    def __enter__(self) -> dict[str, Any]:
        """Create the file and map its arrays."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        places, self.start, end = _plan(self.poses)
        with self.partial.open('wb') as file:
            file.truncate(end)
        self.arrays = {
            name: np.memmap(self.partial, ARRAYS[name], 'r+', offset, shape)
            for name, (offset, shape) in places.items()
        }
        return dict(self.arrays)

    def __exit__(self, kind: object, *_: object) -> None:
        """Write the header and rename the file, or drop it after an error."""
        for array in self.arrays.values():
            array.flush()
        self.arrays.clear()
        if kind is not None:
            self.partial.unlink()
            return
        header = json.dumps({
            'poses': self.poses, 'checksum': _checksum(self.partial, self.start),
            'notes': self.notes}).encode()
        with self.partial.open('r+b') as file:
            file.write(MAGIC + len(header).to_bytes(8, 'little') + header)
        self.partial.replace(self.path)


def read_header(path: str | Path) -> LibraryHeader:
    """Return what a file says about itself.

    Raises:
        LibraryFileError: If it is no library file, of another version, or cut short.
    """
    path = Path(path)
    try:
        with path.open('rb') as file:
            start = file.read(16)
            length = int.from_bytes(start[8:16], 'little')
            if start[:8] != MAGIC or length > ALIGNMENT - 16:
                raise LibraryFileError(
                    f'{path}: expected a pose library starting with {MAGIC!r}, '
                    f'found {start[:8]!r}')
            header = json.loads(file.read(length))
            poses, checksum, notes = header['poses'], header['checksum'], header['notes']
        places, _, end = _plan(poses)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise LibraryFileError(f'{path}: expected a pose library, found {error!r}') from error
    if path.stat().st_size != end:
        raise LibraryFileError(
            f'{path}: expected {end} bytes for {poses} poses, found {path.stat().st_size}: '
            'was it copied completely?')
    return LibraryHeader(poses, checksum, notes, places)


def load_library(path: str | Path, *, verify: bool = False) -> PoseLibrary:
    """Return a library whose arrays stay in the file until they are touched.

    Args:
        path: Library file.
        verify: Read everything once and compare the checksum.

    Raises:
        LibraryFileError: If the file is damaged or not a library of this version.
    """
    path = Path(path)
    header = read_header(path)
    if verify:
        found = _checksum(path, ALIGNMENT)
        if found != header.checksum:
            raise LibraryFileError(
                f'{path}: expected checksum {header.checksum:08x}, found {found:08x}: '
                'the file is damaged, build it again')
    return PoseLibrary(**{
        name: np.memmap(path, ARRAYS[name], 'r', offset, shape)
        for name, (offset, shape) in header.places.items()
    })


def _plan(poses: int) -> tuple[dict[str, tuple[int, tuple[int, ...]]], int, int]:
    """Return place and shape of each array, where data start, and the size of the file."""
    if not isinstance(poses, int) or poses <= 0:
        raise LibraryFileError(f'pose library: expected at least one pose, found {poses}')
    offset, places = ALIGNMENT, {}
    for name, shape in array_shapes(poses).items():
        places[name] = (offset, shape)
        size = int(np.prod(shape)) * ARRAYS[name].itemsize
        offset += -(-size // ALIGNMENT) * ALIGNMENT
    return places, ALIGNMENT, offset


def _checksum(path: Path, start: int) -> int:
    value = 0
    with path.open('rb') as file:
        file.seek(start)
        while chunk := file.read(CHUNK_BYTES):
            value = zlib.crc32(chunk, value)
    return value
