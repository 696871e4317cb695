"""RTMDet and YOLOX as mmdeploy exports them: boxes of people, suppression inside.

Outputs: `dets` (1, n, 5) left, top, right, bottom, score, in pixels of the input, and `labels`
(1, n), 0 for a person. Input: BGR, float32, NCHW, the image in the upper left corner on grey 114;
RTMDet's (Lyu et al. 2022) with ImageNet's mean and standard deviation, YOLOX's 0..255 without.
The outputs do not tell one from the other.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import UInt8

from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run
from pop_core.keypoints.network_input import (
    BYTES_BGR,
    IMAGENET_BGR,
    Colours,
    input_size,
    planes,
    takes_planes,
)
from pop_core.keypoints.one_stage import person_boxes

GREY = 114
SIDE, MULTIPLE = 640, 32
PERSON = 0


class RtmDetDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'rtmdet'
    expects: ClassVar[str] = 'one input (1, 3, h, w) float -> boxes (1, n, 5), labels (1, n)'
    colours: ClassVar[Colours] = IMAGENET_BGR

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and the order of the outputs."""
        self.size = spec.inputs[0].shape[2], spec.inputs[0].shape[3]
        self.boxes = next(i for i, o in enumerate(spec.outputs) if len(o.shape) == 3)

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        shapes = sorted((output.shape for output in spec.outputs), key=len)
        return (takes_planes(spec) and [len(shape) for shape in shapes] == [2, 3]
                and shapes[1][2] == 5)

    def find_boxes(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[PersonBox]:
        """Return a box around every person, best first."""
        height, width = input_size(self.size, (rgb.shape[0], rgb.shape[1]), SIDE, MULTIPLE)
        image, placed = letterbox(rgb, height, width, GREY, centred=False)
        outputs = run(planes(image, self.colours))
        dets, labels = outputs[self.boxes][0].astype(np.float64), outputs[1 - self.boxes][0]
        count = min(len(dets), len(labels))
        boxes = dets[:count, :4]
        scores = np.where(labels[:count] == PERSON, dets[:count, 4], 0.0)
        return person_boxes(boxes, scores, placed)


class YoloxSuppressedDecoder(RtmDetDecoder):
    """The same outputs of a YOLOX."""

    name: ClassVar[str] = 'yolox_mmdeploy'
    colours: ClassVar[Colours] = BYTES_BGR
