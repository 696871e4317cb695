"""Where the pixels of a distorted image and of its pinhole lie in each other, kept per camera.

Both directions cost far more to find than to use, and a camera sends thirty images a second.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from pop_core.geometry.camera import Camera

KEPT = 4  # cameras
ImageT = TypeVar('ImageT', bound=np.ndarray)


@dataclass(frozen=True, slots=True, eq=False)
class PixelMap:
    """Where each pixel of one image lies in another.

    Args:
        u: Column in the other image [px].
        v: Row [px].
    """

    u: Float32[np.ndarray, 'h w']
    v: Float32[np.ndarray, 'h w']

    def nearest(self, image: ImageT, border: float) -> ImageT:
        """Return an image of one channel with the other's nearest pixels, `border` beyond it."""
        return cv2.remap(  # type: ignore[return-value]
            image, self.u, self.v, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT,
            borderValue=border)

    def mask(self, mask: Bool[np.ndarray, 'h w']) -> Bool[np.ndarray, 'h w']:
        """Return a mask of the other image in the pixels of this one; false beyond the other."""
        return self.nearest(mask.view(np.uint8), 0.0).view(bool)

    def interpolated(self, image: ImageT) -> ImageT:
        """Return an image of any channels, interpolated, black beyond the other."""
        return cv2.remap(image, self.u, self.v, cv2.INTER_LINEAR)  # type: ignore[return-value]


@dataclass(frozen=True, slots=True, eq=False)
class LensMaps:
    """A camera's own image and the image of the pinhole of the same intrinsics.

    Args:
        of_pinhole: Where each pixel of the pinhole's image lies in the camera's.
        of_camera: Where each pixel of the camera's image lies in the pinhole's.
    """

    of_pinhole: PixelMap
    of_camera: PixelMap


def lens_maps(camera: Camera) -> LensMaps:
    """Return the maps of a camera with distortion."""
    c = camera
    return _lens_maps(
        (c.width, c.height), (c.fx, c.fy, c.cx, c.cy), c.distortion_model, tuple(c.d.tolist()))


@lru_cache(maxsize=KEPT)
def _lens_maps(
    size: tuple[int, int], intrinsics: tuple[float, float, float, float], model: str,
    d: tuple[float, ...],
) -> LensMaps:
    camera = Camera(*size, *intrinsics, model, np.array(d))
    find = (
        cv2.fisheye.initUndistortRectifyMap if model == 'equidistant'
        else cv2.initUndistortRectifyMap)
    seen = find(camera.K, camera.d, np.eye(3), camera.K, size, cv2.CV_32FC1)
    pinhole_px = camera.ray_grid() * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    return LensMaps(
        PixelMap(np.asarray(seen[0]), np.asarray(seen[1])),
        PixelMap(*np.moveaxis(pinhole_px, -1, 0).astype(np.float32, order='C')))
