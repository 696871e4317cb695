"""MoveNet multipose (Google 2021): up to six people in one pass.

Input: RGB, 0..255, int32, NHWC; sides are multiples of 32, the longer one 256. Output (1, 6, 56):
y, x, score of COCO's 17 keypoints, then top, left, bottom, right, score of the person, places as
shares of the input's sides.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import UInt8

from pop_core.keypoints.detection import Detection
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run
from pop_core.keypoints.network_input import input_size
from pop_core.keypoints.one_stage import PeopleRows, people_of

SIDE, MULTIPLE = 256, 32
COLUMNS = 56
KINDS = {'int32': np.int32, 'uint8': np.uint8, 'float32': np.float32}


class MoveNetDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'movenet_multipose'
    expects: ClassVar[str] = (
        'one input (1, h, w, 3) int32, uint8 or float32 -> people (1, 6, 56) float32')

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and element type."""
        self.size = spec.inputs[0].shape[1], spec.inputs[0].shape[2]
        self.kind = KINDS[spec.inputs[0].dtype]

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        if len(spec.inputs) != 1 or len(spec.outputs) != 1:
            return False
        entry, output = spec.inputs[0], spec.outputs[0].shape
        return (len(entry.shape) == 4 and entry.shape[3] == 3 and entry.dtype in KINDS
                and len(output) == 3 and output[2] == COLUMNS)

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the people of an image, best first."""
        height, width = input_size(self.size, (rgb.shape[0], rgb.shape[1]), SIDE, MULTIPLE)
        image, placed = letterbox(rgb, height, width)
        output = run(image[None].astype(self.kind))[0][0].astype(np.float64)
        sides = np.array([width, height])
        keypoints = output[:, :51].reshape(len(output), 17, 3)[:, :, [1, 0, 2]]
        keypoints[:, :, :2] = keypoints[:, :, :2] * sides - 0.5
        corners = output[:, [52, 51, 54, 53]] * [*sides, *sides] - 0.5
        return people_of(PeopleRows(corners, output[:, 55], keypoints), placed)
