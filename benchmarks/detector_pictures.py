"""Pictures of what a detector says: keypoints and body parts over the colour image."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import UInt8

from pop_core.keypoints.detection import Detection
from pop_core.keypoints.skeleton import TREE_PARENT
from pop_core.rendering.palette import INK, PAPER, person_color
from pop_core.rgbd import RgbdFrame

RADIUS_PX = 5
PART_OPACITY = 0.55


def draw_detections(
    frame: RgbdFrame, people: Sequence[Detection]
) -> UInt8[np.ndarray, 'h w 3']:
    """Return the colour image with keypoints (hollow: hidden), beside it the body parts."""
    left, right = frame.rgb.copy(), frame.rgb // 2 + 60
    for index, person in enumerate(people):
        if person.part_labels is not None:
            colours = _part_colours()[person.part_labels]
            shown = (person.part_labels >= 0)[..., None]
            right = np.where(
                shown, PART_OPACITY * colours + (1 - PART_OPACITY) * right, right)
        _draw_keypoints(left, person, person_color(index))
    return np.hstack([left, right.astype(np.uint8)])


def _draw_keypoints(
    picture: UInt8[np.ndarray, 'h w 3'], person: Detection, colour: tuple[int, int, int]
) -> None:
    uv = person.keypoints_px
    for joint, parent in enumerate(TREE_PARENT):
        if parent >= 0 and np.isfinite(uv[[joint, parent]]).all():
            cv2.line(picture, _pixel(uv[joint]), _pixel(uv[parent]), INK, 5, cv2.LINE_AA)
            cv2.line(picture, _pixel(uv[joint]), _pixel(uv[parent]), colour, 3, cv2.LINE_AA)
    for joint, point in enumerate(uv):
        if np.isfinite(point).all():
            seen = person.visible is None or person.visible[joint] > 0.5
            cv2.circle(picture, _pixel(point), RADIUS_PX, PAPER if seen else INK, -1, cv2.LINE_AA)
            cv2.circle(picture, _pixel(point), RADIUS_PX, colour, 1, cv2.LINE_AA)


def _pixel(uv: np.ndarray) -> tuple[int, int]:
    return round(float(uv[0])), round(float(uv[1]))


def _part_colours() -> UInt8[np.ndarray, '25 3']:
    """Return a colour per joint label, neighbours far apart in hue."""
    hue = (np.arange(25) * 67 % 180).astype(np.uint8)
    hsv = np.dstack([hue, np.full(25, 200, np.uint8), np.full(25, 255, np.uint8)])
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB)[0])
