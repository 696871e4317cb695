"""The window of the image around a body whose place is known."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.fitting.observation import Window
from pop_core.geometry.camera import Camera

MARGIN_M = 0.25  # a fast arm between two frames, clothes and hair
NEAREST_M = 0.3


def body_window(
    p_camera: Float[np.ndarray, 'n 3'], camera: Camera, longest_px: int = 100_000,
    margin_m: float = MARGIN_M,
) -> Window:
    """Return the window that holds the points of a body [m], at least one pixel of the image.

    Args:
        p_camera: Points, camera frame.
        camera: Pinhole of the image.
        longest_px: Longest side of the window once thinned.
        margin_m: What is kept around the points [m].
    """
    z = np.maximum(p_camera[:, 2], NEAREST_M)
    margin_px = margin_m * max(camera.fx, camera.fy) / float(np.median(z))
    left, right = _span(camera.fx * p_camera[:, 0] / z + camera.cx, margin_px, camera.width)
    top, bottom = _span(camera.fy * p_camera[:, 1] / z + camera.cy, margin_px, camera.height)
    stride = max(1, -(-max(right - left, bottom - top) // longest_px))
    return Window(left, top, right - left, bottom - top, stride)


def _span(pixel: Float[np.ndarray, 'n'], margin_px: float, size: int) -> tuple[int, int]:
    """Return first pixel and end of the part of an image that holds all pixels."""
    low = int(np.clip(np.floor(pixel.min() - margin_px), 0, size - 1))
    high = int(np.clip(np.ceil(pixel.max() + margin_px) + 1, low + 1, size))
    return low, high
