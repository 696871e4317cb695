"""Cut a person's box out of an image for a network that looks at one person at a time."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from pop_core.keypoints.letterbox import Letterbox, letterbox

ROOM = 1.25  # a box is enlarged so that limbs at its border are seen with what surrounds them


@dataclass(frozen=True, slots=True)
class Crop:
    """Where a network's input lies in the image; pixel centres are integers.

    Args:
        left: First column of the region [px of the image].
        top: First row of the region.
        placed: Where the region lies in the input.
    """

    left: int
    top: int
    placed: Letterbox

    def to_image(self, uv: Float[np.ndarray, 'n 2']) -> Float[np.ndarray, 'n 2']:
        """Return pixels of the image of pixels of the network's input."""
        return self.placed.to_image(uv) + [self.left, self.top]


def crop_box(
    rgb: UInt8[np.ndarray, 'h w 3'], box_px: Float[np.ndarray, '4'], height: int, width: int
) -> tuple[UInt8[np.ndarray, 'H W 3'], Crop] | None:
    """Return height x width pixels around a box and where they lie, black outside of the image.

    None where the box and the image have no pixel in common.
    """
    h, w = rgb.shape[:2]
    low = np.clip(box_px[:2], -0.5, [w - 0.5, h - 0.5])
    high = np.clip(box_px[2:], -0.5, [w - 0.5, h - 0.5])
    if not np.isfinite(box_px).all() or (high - low).min() < 1.0:
        return None
    size = ROOM * (high - low)
    size = np.maximum(size, size[::-1] * [width / height, height / width])
    left, top = (int(v) for v in np.floor(0.5 * (low + high - size) + 0.5))
    right, bottom = left + max(1, round(float(size[0]))), top + max(1, round(float(size[1])))
    region = rgb[max(0, top): min(h, bottom), max(0, left): min(w, right)]
    region = np.asarray(cv2.copyMakeBorder(
        region, max(0, -top), max(0, bottom - h), max(0, -left), max(0, right - w),
        cv2.BORDER_CONSTANT), np.uint8)
    image, placed = letterbox(region, height, width)
    return image, Crop(left, top, placed)
