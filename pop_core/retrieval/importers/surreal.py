"""SURREAL clips (Varol et al. 2017): poses, and what of them the camera saw.

`NAME_info.mat` holds pose (72,T), joints2D (2,24,T) and more. Where `NAME_depth.mat` and
`NAME_segm.mat` lie beside it, the joints of every frame are lifted by the same steps as a live
image's, and what could be lifted becomes the pose's visibility, as in the paper.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, UInt16
from scipy.io import loadmat

from pop_core.body.joints import SHARED
from pop_core.errors import LibraryFileError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifting import lift_keypoints
from pop_core.retrieval.importers.clip import PoseClip, make_clip
from pop_core.retrieval.pose_library import visibility_mask
from pop_core.rgbd import RgbdFrame

# Blender's camera of every SURREAL clip: 60 mm lens, 32 mm sensor, 320 x 240 pixels.
CAMERA = Camera(320, 240, 600.0, 600.0, 160.0, 120.0)
FARTHEST_M = 1e6  # the background is written as 1e10


def read_surreal(info: Path) -> PoseClip:
    """Return the poses of one clip.

    Args:
        info: The file whose name ends in `_info.mat`.

    Raises:
        LibraryFileError: If a file is damaged or of another layout.
    """
    data = _load(info, ('pose', 'joints2D'))
    pose = _columns(data, 'pose', 72)
    n = len(pose)
    masks = None
    depth, segm = (
        info.with_name(info.name.replace('_info.mat', f'_{kind}.mat'))
        for kind in ('depth', 'segm'))
    if depth.exists() and segm.exists():
        pixels = _columns(data, 'joints2D', 48).reshape(n, 2, 24).transpose(0, 2, 1)
        masks = visibility(depth, segm, pixels)
    return make_clip(pose[:, :3], pose[:, 3:].reshape(n, 23, 3), 'z', masks)


def visibility(
    depth: Path, segm: Path, pixels: Float[np.ndarray, 'n 24 2']
) -> UInt16[np.ndarray, 'n']:
    """Return the bitset of joints that can be lifted in every frame of a clip.

    Args:
        depth: File of `depth_1` ... `depth_T` (240,320) [m].
        segm: File of `segm_1` ... `segm_T` (240,320), 0 off the person.
        pixels: Joints of every frame [px].
    """
    depths, people = _load(depth, None), _load(segm, None)
    masks = np.zeros(len(pixels), dtype=np.uint16)
    for frame, uv in enumerate(pixels[:, SHARED]):
        z = _image(depths, f'depth_{frame + 1}', depth).astype(np.float32)
        mask = _image(people, f'segm_{frame + 1}', segm) > 0
        z = np.where((z > 0) & (z < FARTHEST_M), z, np.float32(np.nan))
        masks[frame] = visibility_mask(_lifted(z, mask, uv))
    return masks


def _lifted(z: np.ndarray, mask: np.ndarray, uv: np.ndarray) -> np.ndarray:
    detection = Detection(
        keypoints_px=uv, scores=np.ones(len(uv)),
        box_px=np.concatenate([uv.min(axis=0), uv.max(axis=0)]), person_mask=mask)
    rgb = np.zeros((CAMERA.height, CAMERA.width, 3), dtype=np.uint8)
    return np.asarray(lift_keypoints(RgbdFrame(rgb, z, CAMERA), detection).lifted)


def _load(path: Path, names: tuple[str, ...] | None) -> Mapping[str, Any]:
    try:
        return dict(loadmat(path, variable_names=names))
    except FileNotFoundError:
        raise
    except Exception as error:  # a damaged file makes loadmat raise anything
        raise LibraryFileError(f'{path.name}: expected a MATLAB file, found {error}') from error


def _columns(data: Mapping[str, Any], name: str, size: int) -> Float[np.ndarray, 'n x']:
    """Return an array whose last axis is time, one flat row per frame."""
    if name not in data:
        found = sorted(key for key in data if not key.startswith('__'))
        raise LibraryFileError(f'expected the variable {name}, found {found}')
    array = np.asarray(data[name])
    if array.dtype.kind not in 'fiu' or array.size == 0 or array.size % size:
        raise LibraryFileError(
            f'{name}: expected {size} numbers per frame, found {array.dtype} {array.shape}')
    return np.asarray(array, dtype=np.float64).reshape(size, -1).T


def _image(data: Mapping[str, Any], name: str, path: Path) -> np.ndarray:
    image = np.asarray(data.get(name, np.zeros((0, 0))))
    if image.shape != (CAMERA.height, CAMERA.width):
        raise LibraryFileError(
            f'{path.name}: expected {name} of {CAMERA.height}x{CAMERA.width}, '
            f'found {image.shape}')
    return image
