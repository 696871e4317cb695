"""YOLOX object detectors (Ge et al. 2021) as their authors export them: boxes of people.

Input: BGR, 0..255, no normalisation, float32, NCHW; the image in the upper left corner on grey
114. Output (1, n, 85): centre and size relative to the cells of three grids (strides 8, 16, 32),
objectness, scores of COCO's 80 classes, a person first.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import Float, UInt8

from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run
from pop_core.keypoints.network_input import BYTES_BGR, planes, takes_planes
from pop_core.keypoints.one_stage import corners_of, person_boxes

GREY = 114
STRIDES = (8, 16, 32)
COLUMNS = 85
LARGEST_LOG = 8.0  # exp of it is 3000 cells


class YoloxDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'yolox'
    expects: ClassVar[str] = (
        'one input (1, 3, h, w) float -> (1, h w / 64 + h w / 256 + h w / 1024, 85)')

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size."""
        _, _, height, width = spec.inputs[0].shape
        self.height, self.width = int(height or 0), int(width or 0)

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        if not takes_planes(spec) or len(spec.outputs) != 1:
            return False
        _, _, height, width = spec.inputs[0].shape
        if not height or not width:
            return False
        cells = sum((height // stride) * (width // stride) for stride in STRIDES)
        return spec.outputs[0].shape[1:] == (cells, COLUMNS)

    def find_boxes(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[PersonBox]:
        """Return a box around every person, best first."""
        image, placed = letterbox(rgb, self.height, self.width, GREY, centred=False)
        output = run(planes(image, BYTES_BGR))[0][0].astype(np.float64)
        cells, stride = _grid(self.height, self.width)
        with np.errstate(invalid='ignore', over='ignore'):
            centre = (output[:, :2] + cells) * stride[:, None]
            size = np.exp(np.minimum(output[:, 2:4], LARGEST_LOG)) * stride[:, None]
            scores = output[:, 4] * output[:, 5]
        boxes = corners_of(np.concatenate([centre, size], axis=1)) - 0.5
        return person_boxes(boxes, scores, placed)


def _grid(
    height: int, width: int
) -> tuple[Float[np.ndarray, 'n 2'], Float[np.ndarray, 'n']]:
    """Return column and row of every cell of the three grids, and its stride [px]."""
    cells, strides = [], []
    for stride in STRIDES:
        v, u = np.mgrid[:height // stride, :width // stride]
        cells.append(np.stack([u.ravel(), v.ravel()], axis=1))
        strides.append(np.full(u.size, float(stride)))
    return np.concatenate(cells).astype(np.float64), np.concatenate(strides)
