"""Folders with one RGB-D frame each: `color.png`, `depth.png`, `camera.json`, `keypoints.json`."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pop_core.errors import FrameError
from pop_core.rgbd import RgbdFrame
from pop_ros.camera_file import load_camera, load_depth_scale
from pop_ros.png_file import load_depth_png, load_rgb_png

IMAGES = ('color.png', 'depth.png')
EXPECTED = 'color.png, depth.png and camera.json, or folders with them'


@dataclass(frozen=True, slots=True)
class FrameFolder:
    """One frame on disk.

    Args:
        path: The folder.
        name: Where its results go below the output folder.
    """

    path: Path
    name: Path

    @property
    def keypoints(self) -> Path:
        """Return where the frame's OpenPose keypoints lie, if it has any."""
        return self.path / 'keypoints.json'


def find_frames(root: str | Path) -> list[FrameFolder]:
    """Return the frames of a folder: itself if it is a frame, else all below it, sorted.

    Raises:
        FrameError: If `root` is no folder, or holds no frame at any depth.
    """
    root = Path(root)
    if not root.is_dir():
        found = 'a file' if root.exists() else 'nothing there'
        raise FrameError(f'{root}: expected a folder with {EXPECTED}, found {found}')
    if _is_frame(root):
        return [FrameFolder(root, Path(root.resolve().name or 'frame'))]
    folders = sorted(path for path in _folders_below(root) if _is_frame(path))
    if not folders:
        raise FrameError(f'{root}: expected {EXPECTED}, found none of these')
    return [FrameFolder(path, path.relative_to(root)) for path in folders]


def load_frame(folder: str | Path, stamp_ns: int = 0) -> RgbdFrame:
    """Return the frame of a folder; `camera.json` may lie in the parent folder.

    Args:
        folder: Where `color.png` and `depth.png` lie.
        stamp_ns: Time of the colour image [ns], which the files do not tell.

    Raises:
        FrameError: If a file is missing, damaged, or does not fit the others.
    """
    folder = Path(folder)
    for name in IMAGES:
        if not (folder / name).is_file():
            raise FrameError(f'{folder}: expected {name}, found none')
    camera_path = _camera_path(folder)
    camera, scale = load_camera(camera_path), load_depth_scale(camera_path)
    size = (camera.width, camera.height)
    rgb = load_rgb_png(folder / IMAGES[0], size)
    units = load_depth_png(folder / IMAGES[1], size)
    depth_m = np.where(units > 0, units * np.float32(1.0 / scale), np.float32(np.nan))
    return RgbdFrame(rgb, depth_m.astype(np.float32), camera, stamp_ns)


def _is_frame(folder: Path) -> bool:
    return any((folder / name).is_file() for name in IMAGES)


def _camera_path(folder: Path) -> Path:
    candidates = [folder / 'camera.json', folder.resolve().parent / 'camera.json']
    for path in candidates:
        if path.is_file():
            return path
    raise FrameError(f'{folder}: expected camera.json here or in the parent folder, found none')


def _folders_below(root: Path) -> list[Path]:
    """Return all folders below one, links followed, each real folder once."""
    seen = {root.resolve()}
    found: list[Path] = []
    for parent, names, _ in os.walk(root, followlinks=True):
        new = [name for name in sorted(names) if (Path(parent) / name).resolve() not in seen]
        seen.update((Path(parent) / name).resolve() for name in new)
        names[:] = new
        found.extend(Path(parent) / name for name in new)
    return found
