"""Training scenes packed into files of a few hundred: drawn once, learned from many times."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, UInt8, UInt16

from pop_core.errors import PopError
from pop_core.keypoints.body_parts import CLASS_OF_LABEL
from pop_core.synthesis.training_scenes import TrainingScene

MAX_PEOPLE = 6
MARGIN_PX = 16  # scenes are larger than the network's input by this: crops shift them
OWNER_SHIFT = 4  # labels hold the class in their low bits and 1 + owner above


# What numpy raises of a file that is no archive of arrays, or a damaged one.
DAMAGED = (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile, zlib.error)


class ShardError(PopError):
    """A file of training scenes that is damaged, or a folder without any."""


@dataclass(frozen=True, slots=True, eq=False)
class Shard:
    """Scenes of one size, stacked; rows of people beyond a scene's own are zero.

    Args:
        depth_mm: Depth [mm], 0 where nothing was measured.
        labels: Class of the body part, plus 16 times (1 + index of the person); 0 elsewhere.
        points: The 15 shared points [m], camera frame.
        visible: Whether the camera sees them.
        lens: fx, fy, cx, cy [px].
    """

    depth_mm: UInt16[np.ndarray, 'n h w']
    labels: UInt8[np.ndarray, 'n h w']
    points: Float32[np.ndarray, 'n 6 15 3']
    visible: Bool[np.ndarray, 'n 6 15']
    lens: Float32[np.ndarray, 'n 4']

    def __len__(self) -> int:
        """Return the number of scenes."""
        return len(self.depth_mm)


def pack(scenes: Sequence[TrainingScene]) -> Shard:
    """Return scenes of one size as a shard."""
    points = np.zeros((len(scenes), MAX_PEOPLE, 15, 3), dtype=np.float32)
    visible = np.zeros((len(scenes), MAX_PEOPLE, 15), dtype=bool)
    for i, scene in enumerate(scenes):
        for k, person in enumerate(scene.people):
            points[i, k], visible[i, k] = person.shared_points, person.visible
    depth_mm = [np.nan_to_num(scene.depth_m * 1e3).round() for scene in scenes]
    labels = [
        CLASS_OF_LABEL[scene.part_labels] | ((scene.owner + 1) << OWNER_SHIFT) for scene in scenes]
    cameras = [scene.camera for scene in scenes]
    return Shard(
        np.clip(np.stack(depth_mm), 0, 65535).astype(np.uint16),
        np.stack(labels).astype(np.uint8), points, visible,
        np.array([(c.fx, c.fy, c.cx, c.cy) for c in cameras], dtype=np.float32))


def save_shard(shard: Shard, path: Path) -> None:
    """Write a shard; readers see it whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix('.part')
    with part.open('wb') as file:
        np.savez(file, **{field.name: getattr(shard, field.name) for field in fields(Shard)})
    part.replace(path)


def load_shard(path: Path) -> Shard:
    """Return the shard of a file.

    Raises:
        ShardError: If the file is no shard.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {field.name: file[field.name] for field in fields(Shard)}
    except DAMAGED as error:
        raise ShardError(f'{path}: expected packed training scenes, found: {error}') from None
    shapes = {name: array.shape for name, array in arrays.items()}
    n, *size = shapes['depth_mm'] if arrays['depth_mm'].ndim == 3 else (-1, -1, -1)
    if shapes != {
            'depth_mm': (n, *size), 'labels': (n, *size), 'points': (n, MAX_PEOPLE, 15, 3),
            'visible': (n, MAX_PEOPLE, 15), 'lens': (n, 4)}:
        raise ShardError(f'{path}: expected packed training scenes, found arrays of {shapes}')
    return Shard(**arrays)


def load_fitting(path: Path, size: tuple[int, int]) -> Shard:
    """Return the scenes of a file that a network of some size is to learn from.

    Args:
        path: The file.
        size: Width and height of the network's input [px].

    Raises:
        ShardError: If the file is no shard, or was drawn for another size.
    """
    shard = load_shard(path)
    height, width = shard.depth_mm.shape[1:]
    wanted = size[0] + MARGIN_PX, size[1] + MARGIN_PX
    if (width, height) != wanted:
        raise ShardError(
            f'{path}: expected scenes of {wanted[0]}x{wanted[1]}, found {width}x{height}: '
            'another --size drew them')
    return shard


def shard_paths(folder: Path) -> list[Path]:
    """Return the shards of a folder, in the order of their names.

    Raises:
        ShardError: If there is none.
    """
    paths = sorted(folder.glob('*.npz'))
    if not paths:
        raise ShardError(f'{folder}: expected training scenes (*.npz), found none: '
                         'write some with python -m pop_core.training scenes')
    return paths
