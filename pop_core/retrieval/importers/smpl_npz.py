"""Poses in npz files: AMASS (SMPL-H and SMPL-X layouts) and any file with SMPL rotations."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from jaxtyping import Float

from pop_core.errors import LibraryFileError
from pop_core.retrieval.importers.clip import PoseClip, make_clip

POSE_KEYS = ('poses', 'pose', 'fullpose', 'body_pose', 'pose_body')
ROOT_KEYS = ('root_orient', 'global_orient')
# AMASS names the rate of its captures; its worlds have z up, plain SMPL has y up.
AMASS_KEYS = ('mocap_framerate', 'mocap_frame_rate')
BODY_NUMBERS = 63  # 21 joints that SMPL, SMPL-H and SMPL-X have in common
# Numbers per frame of layouts that start with the root: SMPL, SMPL-H, SMPL-X, body only.
WITH_ROOT = (66, 72, 156, 165)
WITHOUT_ROOT = (63, 69)


def read_smpl_npz(path: Path, up: str | None = None) -> PoseClip:
    """Return the poses of an npz file.

    Args:
        path: AMASS file, or any npz with SMPL poses of one frame per row.
        up: World axis that points up, 'y' or 'z'; None: z for AMASS files, y for others.

    Raises:
        LibraryFileError: If the file is damaged, holds pickled objects or no SMPL poses.
    """
    try:
        with np.load(path, allow_pickle=False) as data:
            names = set(data.files)
            poses = _first(data, names, POSE_KEYS)
            root = _first(data, names, ROOT_KEYS)
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise LibraryFileError(f'expected an npz of plain arrays, found {error}') from error
    if poses is None:
        raise LibraryFileError(f'expected one of {POSE_KEYS}, found {sorted(names)}')
    root, body = _split(poses, root)
    if up is None:
        up = 'z' if names & set(AMASS_KEYS) else 'y'
    return make_clip(root, body, up)


def _first(
    data: np.lib.npyio.NpzFile, names: set[str], keys: tuple[str, ...]
) -> np.ndarray | None:
    """Return the first array that the file has, one flat row per frame."""
    for key in keys:
        if key in names:
            array = data[key]
            if array.ndim == 0 or not np.issubdtype(array.dtype, np.number):
                raise LibraryFileError(
                    f'{key}: expected rows of numbers, found {array.dtype} {array.shape}')
            flat = array.reshape(len(array), -1) if array.size else np.zeros((0, 72))
            return np.asarray(flat, dtype=np.float64)
    return None


def _split(
    poses: Float[np.ndarray, 'n x'], root: Float[np.ndarray, 'm 3'] | None
) -> tuple[Float[np.ndarray, 'n 3'], Float[np.ndarray, 'n 23 3']]:
    """Return root and body rotations of any layout; fingers are left at rest."""
    n, width = poses.shape
    if width in WITH_ROOT:
        root, body = poses[:, :3], poses[:, 3:]
    elif width in WITHOUT_ROOT:
        root, body = np.zeros((n, 3)) if root is None else root, poses
    else:
        raise LibraryFileError(
            f'expected {WITHOUT_ROOT + WITH_ROOT} numbers per pose, found {width}')
    if root.shape != (n, 3):
        raise LibraryFileError(f'expected {n} root rotations, found {root.shape}')
    out = np.zeros((n, 23, 3))
    if body.shape[1] == 69:
        out[:] = body.reshape(n, 23, 3)
    else:
        out[:, :21] = body[:, :BODY_NUMBERS].reshape(n, 21, 3)
    return root, out
