"""BVH files: a tree of joints with offsets and channels, and one row of numbers per frame."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from pathlib import Path

import numpy as np
from jaxtyping import Float

from pop_core.errors import LibraryFileError

END_SITE = -2  # its offset belongs to no joint
LARGEST_HEADER = 1 << 20  # characters; real headers have some thousands


@dataclass(frozen=True, slots=True, eq=False)
class BvhMotion:
    """A skeleton and its motion.

    Args:
        names: Joint names in the file's order, parents first.
        parents: Index of each joint's parent, -1 for the root.
        offsets: Rest place of each joint relative to its parent [file's units].
        rotations: Rotation of each joint relative to its parent.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Float[np.ndarray, 'j 3']
    rotations: Float[np.ndarray, 'n j 3 3']


@dataclass(slots=True)
class _Joint:
    name: str
    parent: int
    offset: tuple[float, ...]
    channels: tuple[str, ...]


def read_bvh_motion(path: Path, every: int = 1) -> BvhMotion:
    """Return the skeleton and every n-th frame of a BVH file.

    Raises:
        LibraryFileError: If the file is cut short or not a BVH file.
    """
    try:
        text = path.read_text(encoding='latin-1')
    except OSError as error:
        raise LibraryFileError(f'expected a BVH file, found {error}') from error
    header, found, motion = text.partition('MOTION')
    if not found or not header.lstrip().startswith('HIERARCHY') or len(header) > LARGEST_HEADER:
        raise LibraryFileError('expected HIERARCHY and MOTION of a BVH file, found neither')
    joints = _parse_tree(header)
    numbers = _parse_frames(motion, sum(len(joint.channels) for joint in joints))[::every]
    return BvhMotion(
        tuple(joint.name for joint in joints), tuple(joint.parent for joint in joints),
        np.array([joint.offset for joint in joints]), _rotations(joints, numbers))


def _parse_tree(header: str) -> list[_Joint]:
    """Return the joints of a header, parents first."""
    try:
        joints, depth = _walk(iter(header.split()))
    except (StopIteration, ValueError, IndexError) as error:
        raise LibraryFileError('expected a complete BVH hierarchy, found it cut') from error
    if not joints or depth != 0 or any(len(joint.offset) != 3 for joint in joints):
        raise LibraryFileError(f'expected a complete BVH hierarchy, found {len(joints)} joints')
    return joints


def _walk(words: Iterator[str]) -> tuple[list[_Joint], int]:
    """Return the joints and how many brackets stay open; end sites only close theirs."""
    joints: list[_Joint] = []
    stack: list[int] = []
    current = -1
    for word in words:
        if word in ('ROOT', 'JOINT'):
            joints.append(_Joint(next(words), current, (), ()))
            current = len(joints) - 1
        elif word == 'End':
            current = END_SITE
        elif word == '{':
            stack.append(current)
        elif word == '}':
            stack.pop()
            current = stack[-1] if stack else -1
        elif word == 'OFFSET':
            offset = tuple(float(next(words)) for _ in range(3))
            if current != END_SITE:
                joints[current].offset = offset
        elif word == 'CHANNELS':
            joints[current].channels = tuple(next(words) for _ in range(int(next(words))))
    return joints, len(stack)


def _parse_frames(motion: str, width: int) -> Float[np.ndarray, 'n x']:
    """Return the rows of numbers after `Frames:` and `Frame Time:`."""
    head = motion.split(None, 5)
    if len(head) < 6 or head[0] != 'Frames:' or head[2:4] != ['Frame', 'Time:']:
        raise LibraryFileError(f'expected Frames: and Frame Time:, found {" ".join(head[:4])!r}')
    try:
        frames = int(head[1])
        with warnings.catch_warnings():
            warnings.simplefilter('error')  # numpy only warns where text is not a number
            numbers = np.fromstring(head[5], dtype=np.float64, sep=' ')
    except (ValueError, DeprecationWarning) as error:
        raise LibraryFileError(f'expected rows of numbers, found {error}') from error
    if frames <= 0 or numbers.size != frames * width:
        raise LibraryFileError(
            f'expected {frames} frames of {width} numbers, found {numbers.size} numbers')
    rows = numbers.reshape(frames, width)
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        raise LibraryFileError(f'frame {int(np.argmin(finite))}: expected finite numbers')
    return rows


def _rotations(
    joints: list[_Joint], numbers: Float[np.ndarray, 'n x']
) -> Float[np.ndarray, 'n j 3 3']:
    """Return local rotations of Euler channels [degrees], applied in the file's order."""
    out = np.tile(np.eye(3), (len(numbers), len(joints), 1, 1))
    column = 0
    for j, joint in enumerate(joints):
        turns = [
            (channel[0].upper(), column + k)
            for k, channel in enumerate(joint.channels) if channel.endswith('rotation')
        ]
        column += len(joint.channels)
        if turns:
            factors = [_axis_turn(axis, np.deg2rad(numbers[:, place])) for axis, place in turns]
            out[:, j] = reduce(np.matmul, factors)
    return out


def _axis_turn(axis: str, angle: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'n 3 3']:
    """Return rotations about a coordinate axis [rad]."""
    k = 'XYZ'.index(axis)
    a, b = (k + 1) % 3, (k + 2) % 3
    out = np.zeros((len(angle), 3, 3))
    out[:, k, k] = 1.0
    out[:, a, a] = out[:, b, b] = np.cos(angle)
    out[:, b, a] = np.sin(angle)
    out[:, a, b] = -out[:, b, a]
    return out
