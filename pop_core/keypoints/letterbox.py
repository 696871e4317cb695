"""Fit an image into a network's input without changing its aspect, and map pixels back."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

UNTOUCHED = 1.01  # enlarging by less than a hundredth only blurs


@dataclass(frozen=True, slots=True)
class Letterbox:
    """Where an image lies in a network's input; pixel centres are integers.

    Args:
        factor_u: Network pixels per image pixel, along u.
        factor_v: The same along v; they differ by rounding to whole pixels only.
        left: Columns of padding before the image [px].
        top: Rows of padding above the image [px].
    """

    factor_u: float
    factor_v: float
    left: int
    top: int

    def to_image(self, uv: Float[np.ndarray, 'n 2']) -> Float[np.ndarray, 'n 2']:
        """Return pixels of the image of pixels of the network's input."""
        return (uv - [self.left, self.top] + 0.5) / [self.factor_u, self.factor_v] - 0.5


def letterbox(
    rgb: UInt8[np.ndarray, 'h w 3'],
    height: int,
    width: int,
    fill: int = 0,
    *,
    centred: bool = True,
) -> tuple[UInt8[np.ndarray, 'H W 3'], Letterbox]:
    """Return the image resized into height x width on a plain ground, and where it lies.

    Args:
        rgb: The image.
        height: Rows of the network's input.
        width: Columns of the network's input.
        fill: Grey value of the ground.
        centred: False puts the image into the upper left corner.
    """
    h, w = rgb.shape[:2]
    factor = min(height / h, width / w)
    if 1.0 < factor < UNTOUCHED:
        factor = 1.0
    inner_h, inner_w = max(1, round(h * factor)), max(1, round(w * factor))
    resized = rgb
    if (inner_h, inner_w) != (h, w):
        # Averaging when shrinking: linear sampling would alias thin limbs away.
        how = cv2.INTER_AREA if factor < 1 else cv2.INTER_LINEAR
        resized = np.asarray(cv2.resize(rgb, (inner_w, inner_h), interpolation=how), np.uint8)
    top, left = ((height - inner_h) // 2, (width - inner_w) // 2) if centred else (0, 0)
    out = np.full((height, width, 3), fill, dtype=np.uint8)
    out[top: top + inner_h, left: left + inner_w] = resized
    return out, Letterbox(inner_w / w, inner_h / h, left, top)
