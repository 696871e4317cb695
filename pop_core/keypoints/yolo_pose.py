"""YOLO pose networks (YOLOv8, YOLO11 and later): whole people in one pass.

Input: RGB / 255, float32, NCHW; the image centred on grey 114. Output, in pixels of the input
whose upper left corner is (0, 0), with u, v, score of COCO's 17 keypoints in the last 51 places:
without suppression inside (1, 56, n) centre, width, height, score; with it (1, n, 57) left, top,
right, bottom, score, class.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import Float, UInt8

from pop_core.keypoints.detection import Detection
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run
from pop_core.keypoints.network_input import UNIT_RGB, input_size, planes, takes_planes
from pop_core.keypoints.one_stage import PeopleRows, corners_of, people_of

GREY = 114
SIDE, MULTIPLE = 640, 32
RAW, SUPPRESSED = 56, 57
MOST_PEOPLE = 1000  # rows of an output with suppression inside; without it there are thousands


class YoloPoseDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'yolo_pose'
    expects: ClassVar[str] = (
        'one input (1, 3, h, w) float -> (1, 56, n), or (1, n, 57) with suppression inside')

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
        if len(shape) != 3:
            return False
        return shape[1] == RAW or (shape[2] == SUPPRESSED and (shape[1] or 0) <= MOST_PEOPLE)

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the people of an image, best first."""
        height, width = input_size(self.size, (rgb.shape[0], rgb.shape[1]), SIDE, MULTIPLE)
        image, placed = letterbox(rgb, height, width, GREY)
        output = run(planes(image, UNIT_RGB))[0][0].astype(np.float64)
        return people_of(_raw_rows(output.T) if self.raw else _rows(output, 6), placed)


def _raw_rows(output: Float[np.ndarray, 'n 56']) -> PeopleRows:
    boxes = corners_of(output[:, :4])
    return _rows(np.concatenate([boxes, output[:, 4:]], axis=1), 5)


def _rows(output: Float[np.ndarray, 'n c'], first: int) -> PeopleRows:
    """Return rows of corners, score, ..., keypoints; pixel centres become integers."""
    keypoints = output[:, first:].reshape(len(output), 17, 3) - [0.5, 0.5, 0.0]
    return PeopleRows(output[:, :4] - 0.5, output[:, 4], keypoints)
