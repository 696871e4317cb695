"""RTMPose and other SimCC networks (Li et al. 2022; Jiang et al. 2023): one person per box.

Input: RGB with ImageNet's mean and standard deviation, float32, NCHW; the box, enlarged by a
quarter, on black. Outputs: scores of every column (n, k, 2 w) and every row (n, k, 2 h) for each
of k keypoints, in bins of half a pixel of the input; k is 17 (COCO), 26 (Halpe) or 133 (whole
body).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from jaxtyping import Float, UInt8

from pop_core.keypoints.box_crop import crop_box
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.keypoint_sets import BY_COUNT, shared_joints
from pop_core.keypoints.network import NetworkSpec, Run, Tensor
from pop_core.keypoints.network_input import IMAGENET, planes, takes_planes
from pop_core.keypoints.people import detection_of


class SimccDecoder:
    """Looks at one box after the other."""

    name: ClassVar[str] = 'rtmpose'
    expects: ClassVar[str] = (
        'one input (n, 3, h, w) float -> columns (n, k, x) and rows (n, k, y) of k = '
        f'{", ".join(map(str, BY_COUNT))} keypoints, x / w = y / h')

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size, the keypoint set and the order of the outputs."""
        _, _, height, width = spec.inputs[0].shape
        self.height, self.width = int(height or 0), int(width or 0)
        self.keypoints = BY_COUNT[int(spec.outputs[0].shape[1] or 0)]
        self.columns = 0 if _bins_fit(spec, 0) else 1

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        shapes = [output.shape for output in spec.outputs]
        if not takes_planes(spec) or [len(shape) for shape in shapes] != [3, 3]:
            return False
        same = shapes[0][1] == shapes[1][1] and shapes[0][1] in BY_COUNT
        return same and (_bins_fit(spec, 0) or _bins_fit(spec, 1))

    def detect_in(
        self, rgb: UInt8[np.ndarray, 'h w 3'], boxes: Sequence[PersonBox], run: Run
    ) -> list[Detection]:
        """Return one person for every box in which one is seen."""
        found = (self._look(rgb, box, run) for box in boxes)
        return [person for person in found if person is not None]

    def _look(
        self, rgb: UInt8[np.ndarray, 'h w 3'], box: PersonBox, run: Run
    ) -> Detection | None:
        cropped = crop_box(rgb, box.box_px, self.height, self.width)
        if cropped is None:
            return None
        image, crop = cropped
        outputs = run(planes(image, IMAGENET))
        u, u_score = _peaks(outputs[self.columns], self.width)
        v, v_score = _peaks(outputs[1 - self.columns], self.height)
        uv = crop.to_image(np.column_stack([u, v]))
        keypoints_px, scores = shared_joints(self.keypoints, uv, np.minimum(u_score, v_score))
        return detection_of(keypoints_px, scores) if scores.any() else None


def _bins_fit(spec: NetworkSpec, columns: int) -> bool:
    """Return whether the output of that number has the bins of columns, the other one of rows."""
    _, _, height, width = spec.inputs[0].shape
    x, y = spec.outputs[columns].shape[2], spec.outputs[1 - columns].shape[2]
    return bool(height and width and x and y and x * height == y * width and x >= width)


def _peaks(
    output: Tensor, length: int
) -> tuple[Float[np.ndarray, 'k'], Float[np.ndarray, 'k']]:
    """Return the place [px] and height of each keypoint's largest bin."""
    bins = np.nan_to_num(output[0].astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    best = bins.argmax(axis=1)
    return best * (length / bins.shape[1]), bins[np.arange(len(bins)), best]
