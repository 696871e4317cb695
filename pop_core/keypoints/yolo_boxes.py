"""YOLO object detectors (YOLOv8, YOLO11 and later): boxes of people.

Input: RGB / 255, float32, NCHW; the image centred on grey 114. Output, in pixels of the input
whose upper left corner is (0, 0): without suppression inside (1, 4 + classes, n) centre, width,
height and a score per class, a person first; with it (1, n, 6) left, top, right, bottom, score,
class.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import UInt8

from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run
from pop_core.keypoints.network_input import UNIT_RGB, input_size, planes, takes_planes
from pop_core.keypoints.one_stage import corners_of, person_boxes

GREY = 114
SIDE, MULTIPLE = 640, 32
RAW, SUPPRESSED = 84, 6
PERSON = 0


class YoloBoxDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'yolo_boxes'
    expects: ClassVar[str] = (
        'one input (1, 3, h, w) float -> (1, 84, n), or (1, n, 6) with suppression inside')

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and which of both outputs it is."""
        self.size = spec.inputs[0].shape[2], spec.inputs[0].shape[3]
        self.raw = spec.outputs[0].shape[1] == RAW and spec.outputs[0].shape[2] != SUPPRESSED

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        if not takes_planes(spec) or len(spec.outputs) != 1:
            return False
        shape = spec.outputs[0].shape
        return len(shape) == 3 and (shape[1] == RAW or shape[2] == SUPPRESSED)

    def find_boxes(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[PersonBox]:
        """Return a box around every person, best first."""
        height, width = input_size(self.size, (rgb.shape[0], rgb.shape[1]), SIDE, MULTIPLE)
        image, placed = letterbox(rgb, height, width, GREY)
        output = run(planes(image, UNIT_RGB))[0][0].astype(np.float64)
        if self.raw:
            boxes, scores = corners_of(output[:4].T), output[4 + PERSON]
        else:
            boxes, scores = output[:, :4], np.where(output[:, 5] == PERSON, output[:, 4], 0.0)
        return person_boxes(boxes - 0.5, scores, placed)
