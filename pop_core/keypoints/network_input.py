"""Colour images as the tensors that networks take: planes, range and order of the colours."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from pop_core.keypoints.network import NetworkSpec

FLOATS = ('float32', 'float16')


@dataclass(frozen=True, slots=True)
class Colours:
    """What a network subtracts from and divides colours of 0..255 by.

    Args:
        mean: Of red, green and blue.
        std: Of red, green and blue.
        bgr: Whether the network takes blue first.
    """

    mean: tuple[float, float, float] = (0.0, 0.0, 0.0)
    std: tuple[float, float, float] = (1.0, 1.0, 1.0)
    bgr: bool = False


IMAGENET = Colours((123.675, 116.28, 103.53), (58.395, 57.12, 57.375))
IMAGENET_BGR = Colours(IMAGENET.mean, IMAGENET.std, bgr=True)
UNIT_RGB = Colours(std=(255.0, 255.0, 255.0))
BYTES_BGR = Colours(bgr=True)
OPENPOSE_BGR = Colours((128.0, 128.0, 128.0), (256.0, 256.0, 256.0), bgr=True)


def planes(
    image: UInt8[np.ndarray, 'h w 3'], colours: Colours
) -> Float32[np.ndarray, '1 3 h w']:
    """Return an RGB image as normalised planes, in the order that the network takes."""
    out = np.empty((1, 3, *image.shape[:2]), np.float32)
    for row, channel in enumerate((2, 1, 0) if colours.bgr else (0, 1, 2)):
        # One plane after the other: seven times as fast as the whole image at once.
        plane = cv2.extractChannel(image, channel)
        np.multiply(plane, np.float32(1.0 / colours.std[channel]), out=out[0, row])
        out[0, row] -= np.float32(colours.mean[channel] / colours.std[channel])
    return out


def takes_planes(spec: NetworkSpec) -> bool:
    """Return whether the only input is an image of float planes (1 or n, 3, h, w)."""
    if len(spec.inputs) != 1:
        return False
    (entry,) = spec.inputs
    return (len(entry.shape) == 4 and entry.shape[0] in (1, None) and entry.shape[1] == 3
            and entry.dtype in FLOATS)


def input_size(
    declared: tuple[int | None, int | None], image: tuple[int, int], side: int, multiple: int
) -> tuple[int, int]:
    """Return rows and columns of the network's input for an image.

    Args:
        declared: Rows and columns that the network takes; None where any number will do.
        image: Rows and columns of the image.
        side: Free inputs get the image's aspect with this length of the longer side.
        multiple: Free lengths are multiples of this.
    """
    longer = max(image)
    free = [max(multiple, round(side * length / longer / multiple) * multiple)
            for length in image]
    height, width = (given or found for given, found in zip(declared, free, strict=True))
    return height, width
