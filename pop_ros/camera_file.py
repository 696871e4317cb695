"""Read `camera.json`: `width height fx fy cx cy`, perhaps `distortion_model d quarter_turns`.

Beside a depth image, it may also say what that counts: `depth_scale`.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from pop_core.errors import CameraError, FrameError
from pop_core.geometry.camera import Camera
from pop_ros.json_file import load_json_object

INTRINSICS = ('fx', 'fy', 'cx', 'cy')
MILLIMETRES = 1000.0
DEPTH_SCALES = (1.0, 1e6)  # metres and micrometres: no 16-bit image counts anything else


def load_camera(path: str | Path) -> Camera:
    """Return the camera of a `camera.json`.

    Raises:
        FrameError: If the file is no JSON object, or a value is missing, of another type or
            not a camera's.
    """
    path = Path(path)
    content = load_json_object(path)
    width, height = (_integer(content, name, path) for name in ('width', 'height'))
    fx, fy, cx, cy = (_number(content.get(name), name, path) for name in INTRINSICS)
    model = content.get('distortion_model') or ''
    if not isinstance(model, str):
        raise FrameError(f'{path}: expected distortion_model as text, found {model!r}')
    coefficients = content.get('d') or []
    if not isinstance(coefficients, list):
        raise FrameError(f'{path}: expected d as a list of numbers, found {coefficients!r}')
    d = np.array([_number(value, 'd', path) for value in coefficients], dtype=np.float64)
    turns = _integer({'quarter_turns': 0} | content, 'quarter_turns', path)
    try:
        return Camera(width, height, fx, fy, cx, cy, model if d.size else '', d, turns)
    except CameraError as error:
        raise FrameError(f'{path}: {error}') from None


def load_depth_scale(path: str | Path) -> float:
    """Return how many units of the depth images beside a `camera.json` make a metre.

    Raises:
        FrameError: If the file is no JSON object, or the value no such number.
    """
    path = Path(path)
    value = load_json_object(path).get('depth_scale', MILLIMETRES)
    scale = _number(value, 'depth_scale', path)
    low, high = DEPTH_SCALES
    if low <= scale <= high:
        return scale
    inverse = f': {1.0 / scale:g}, where that is metres per unit' if 0.0 < scale < low else ''
    raise FrameError(
        f'{path}: expected depth_scale as units per metre, {low:g} to {high:g} (1000 for '
        f'millimetres), found {scale:g}{inverse}')


def camera_json(camera: Camera) -> dict[str, Any]:
    """Return a camera as `load_camera` reads it."""
    content: dict[str, Any] = {'width': camera.width, 'height': camera.height}
    content.update({name: float(getattr(camera, name)) for name in INTRINSICS})
    if camera.d.size:
        content.update(distortion_model=camera.distortion_model, d=camera.d.tolist())
    if camera.quarter_turns:
        content['quarter_turns'] = camera.quarter_turns
    return content


def _integer(content: dict[str, Any], name: str, path: Path) -> int:
    value = _number(content.get(name), name, path)
    if value != int(value):
        raise FrameError(f'{path}: expected {name} as a whole number, found {value}')
    return int(value)


def _number(value: object, name: str, path: Path) -> float:
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    if not plain or not _is_finite(value):  # type: ignore[arg-type]
        found = 'nothing' if value is None else repr(value)[:40]
        raise FrameError(f'{path}: expected {name} as a finite number, found {found}')
    return float(value)  # type: ignore[arg-type]


def _is_finite(value: float) -> bool:
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond every float
        return False
