"""RTMO (Lu et al. 2024) as exported by mmdeploy: whole people in one pass, suppression inside.

Input: BGR, 0..255, no normalisation, float32, NCHW; the image in the upper left corner on grey
114. Outputs: `dets` (1, n, 5) left, top, right, bottom, score, and `keypoints` (1, n, 17, 3)
u, v, score of COCO's keypoints, in pixels of the input.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from jaxtyping import UInt8

from pop_core.keypoints.detection import Detection
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run
from pop_core.keypoints.network_input import BYTES_BGR, input_size, planes, takes_planes
from pop_core.keypoints.one_stage import PeopleRows, people_of

GREY = 114
SIDE, MULTIPLE = 640, 32


class RtmoDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'rtmo'
    expects: ClassVar[str] = (
        'one input (1, 3, h, w) float -> boxes (1, n, 5) and keypoints (1, n, 17, 3)')

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and the order of the outputs."""
        self.size = spec.inputs[0].shape[2], spec.inputs[0].shape[3]
        self.boxes = next(i for i, o in enumerate(spec.outputs) if len(o.shape) == 3)

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        shapes = sorted((output.shape for output in spec.outputs), key=len)
        return (takes_planes(spec) and [len(shape) for shape in shapes] == [3, 4]
                and shapes[0][2] == 5 and shapes[1][2:] == (17, 3))

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the people of an image, best first."""
        height, width = input_size(self.size, (rgb.shape[0], rgb.shape[1]), SIDE, MULTIPLE)
        image, placed = letterbox(rgb, height, width, GREY, centred=False)
        outputs = run(planes(image, BYTES_BGR))
        dets, keypoints = outputs[self.boxes][0], outputs[1 - self.boxes][0]
        count = min(len(dets), len(keypoints))
        rows = PeopleRows(dets[:count, :4].astype(np.float64), dets[:count, 4].astype(np.float64),
                          keypoints[:count].astype(np.float64))
        return people_of(rows, placed)
