"""Frames of cameras mounted on their side or upside down, turned upright for networks.

These know upright people. What they find is turned back: all others work in the camera's pixels.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pop_core.geometry.camera import Camera
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.detection import Detection
from pop_core.rgbd import RgbdFrame


def detect_upright(
    find: Callable[[RgbdFrame], list[Detection]], frame: RgbdFrame
) -> list[Detection]:
    """Return who is found in a frame once its image stands upright.

    Args:
        find: Finds people in upright images.
        frame: The frame as the camera gave it.
    """
    people = find(upright_frame(frame))
    return [turned_back(person, frame.camera) for person in people]


def upright_frame(frame: RgbdFrame) -> RgbdFrame:
    """Return a frame turned upright as its camera says (`Camera.quarter_turns`)."""
    turns, camera = frame.camera.quarter_turns, frame.camera
    if turns == 0:
        return frame
    for _ in range(turns):
        camera = camera.turned()
    return RgbdFrame(
        np.ascontiguousarray(np.rot90(frame.rgb, turns)),
        np.ascontiguousarray(np.rot90(frame.depth_m, turns)), camera, frame.stamp_ns)


def turned_back(detection: Detection, camera: Camera) -> Detection:
    """Return a detection of the upright image in the pixels of the camera's own."""
    turns, mask, labels = camera.quarter_turns, detection.person_mask, detection.part_labels
    if turns == 0:
        return detection
    return replace(
        detection, keypoints_px=_pixels_back(detection.keypoints_px, camera),
        box_px=_box_back(detection.box_px, camera),
        person_mask=None if mask is None else np.ascontiguousarray(np.rot90(mask, -turns)),
        part_labels=None if labels is None else np.ascontiguousarray(np.rot90(labels, -turns)))


def upright_box(box: PersonBox, camera: Camera) -> PersonBox:
    """Return a box of the camera's image in the pixels of the upright one."""
    return PersonBox(_around(upright_pixels(box.box_px.reshape(2, 2), camera)), box.score)


def upright_pixels(uv: Float[np.ndarray, 'n 2'], camera: Camera) -> Float[np.ndarray, 'n 2']:
    """Return pixels (u, v) of the camera's image in the upright one."""
    width, height = camera.width, camera.height
    for _ in range(camera.quarter_turns):
        uv = np.column_stack([uv[:, 1], width - 1 - uv[:, 0]])
        width, height = height, width
    return uv


def points_turned_back(
    points: Float[np.ndarray, 'n 3'], camera: Camera
) -> Float[np.ndarray, 'n 3']:
    """Return points of the upright camera's frame in the camera's own."""
    x, y, z = points.T
    for _ in range(camera.quarter_turns):
        x, y = -y, x
    return np.column_stack([x, y, z])


def box_turned_back(box: PersonBox, camera: Camera) -> PersonBox:
    """Return a box of the upright image in the pixels of the camera's own."""
    return PersonBox(_box_back(box.box_px, camera), box.score)


def _pixels_back(uv: Float[np.ndarray, 'n 2'], camera: Camera) -> Float[np.ndarray, 'n 2']:
    """Return pixels (u, v) of the upright image in the camera's own."""
    for turn in reversed(range(camera.quarter_turns)):
        width = camera.height if turn % 2 else camera.width  # of the image before this turn
        uv = np.column_stack([width - 1 - uv[:, 1], uv[:, 0]])
    return uv


def _box_back(box_px: Float[np.ndarray, '4'], camera: Camera) -> Float[np.ndarray, '4']:
    return _around(_pixels_back(box_px.reshape(2, 2), camera))


def _around(corners: Float[np.ndarray, '2 2']) -> Float[np.ndarray, '4']:
    return np.concatenate([corners.min(axis=0), corners.max(axis=0)])
