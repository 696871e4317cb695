"""OpenPose networks (Cao et al. 2019): several people, bottom-up, by part affinity fields.

Input: (BGR - 128) / 256, float32, NCHW; the image centred on black; free sizes are taken 368 px
high. Outputs at stride 8: one map per keypoint and one of the background, then two maps per limb;
BODY_25 has 26 and 52, COCO-18 (also of the lightweight networks of Osokin 2018) 19 and 38, in one
output after each other or in two. Of several stages the last is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float32, UInt8

from pop_core.keypoints.detection import Detection
from pop_core.keypoints.keypoint_sets import BODY_25, COCO_18, KeypointSet, shared_joints
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run, Tensor, TensorSpec, check_grid
from pop_core.keypoints.network_input import OPENPOSE_BGR, planes, takes_planes
from pop_core.keypoints.paf_grouping import Limb, group_people
from pop_core.keypoints.people import detection_of

HEIGHT, MULTIPLE = 368, 16
LARGEST_ASPECT = 4.0  # of free inputs: a strip of 1 x 4000 pixels would ask for gigabytes
MIN_KEYPOINTS = 3


@dataclass(frozen=True, slots=True)
class FieldLayout:
    """Which maps a network gives.

    Args:
        keypoints: Keypoints in the order of the maps.
        heat: Number of heatmaps, the background included.
        fields: Number of maps of part affinity fields.
        limbs: Limbs between shared joints and their fields, from the neck outward.
    """

    keypoints: KeypointSet
    heat: int
    fields: int
    limbs: tuple[Limb, ...]


# Fields between shared joints; those of the face and the feet are not needed. Order of channels:
# the map index of OpenPose's pose parameters.
BODY_25_FIELDS = FieldLayout(BODY_25, 26, 52, (
    Limb(1, 8, 0), Limb(1, 2, 14), Limb(1, 5, 22), Limb(2, 3, 16), Limb(3, 4, 18),
    Limb(5, 6, 24), Limb(6, 7, 26), Limb(8, 9, 6), Limb(9, 10, 2), Limb(10, 11, 4),
    Limb(8, 12, 8), Limb(12, 13, 10), Limb(13, 14, 12), Limb(1, 0, 30),
))
COCO_18_FIELDS = FieldLayout(COCO_18, 19, 38, (
    Limb(1, 2, 12), Limb(1, 5, 20), Limb(2, 3, 14), Limb(3, 4, 16), Limb(5, 6, 22),
    Limb(6, 7, 24), Limb(1, 8, 0), Limb(8, 9, 2), Limb(9, 10, 4), Limb(1, 11, 6),
    Limb(11, 12, 8), Limb(12, 13, 10), Limb(1, 0, 28),
))
LAYOUTS = (BODY_25_FIELDS, COCO_18_FIELDS)


class OpenPoseDecoder:
    """Runs on the whole image."""

    name: ClassVar[str] = 'openpose'
    expects: ClassVar[str] = (
        'one input (1, 3, h, w) float -> heatmaps and part affinity fields, (1, 26, y, x) and '
        '(1, 52, y, x) or (1, 78, y, x) of BODY_25, 19 and 38 or 57 of COCO-18')

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and where the maps of the last stage are."""
        self.size = spec.inputs[0].shape[2], spec.inputs[0].shape[3]
        self.layout, self.heat, self.fields = next(_placed(spec.outputs))

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        return takes_planes(spec) and any(_placed(spec.outputs))

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the people of an image, best first."""
        height, width = self._input_size(rgb.shape[0], rgb.shape[1])
        image, placed = letterbox(rgb, height, width)
        outputs = run(planes(image, OPENPOSE_BGR))
        heat, fields = self._split(outputs)
        cell = np.array([width / heat.shape[2], height / heat.shape[1]])
        detections = []
        for person in group_people(heat, fields, self.layout.limbs):
            uv = placed.to_image((person[:, :2] + 0.5) * cell - 0.5)
            keypoints_px, scores = shared_joints(self.layout.keypoints, uv, person[:, 2])
            if np.count_nonzero(scores) >= MIN_KEYPOINTS:
                detections.append(detection_of(keypoints_px, scores))
        return sorted(detections, key=lambda detection: -detection.score)

    def _input_size(self, rows: int, columns: int) -> tuple[int, int]:
        height = self.size[0] or HEIGHT
        aspect = min(max(columns / rows, 1.0 / LARGEST_ASPECT), LARGEST_ASPECT)
        free = max(MULTIPLE, round(height * aspect / MULTIPLE) * MULTIPLE)
        return height, self.size[1] or free

    def _split(
        self, outputs: Sequence[Tensor]
    ) -> tuple[Float32[np.ndarray, 'k h w'], Float32[np.ndarray, 'c h w']]:
        """Return the heatmaps without the background, and the fields."""
        check_grid('openpose', [outputs[self.heat], outputs[self.fields]])
        count = len(self.layout.keypoints)
        heat = outputs[self.heat][0, :count]
        first = self.layout.heat if self.heat == self.fields else 0
        fields = outputs[self.fields][0, first: first + self.layout.fields]
        return heat.astype(np.float32), fields.astype(np.float32)


def _placed(outputs: Sequence[TensorSpec]) -> Iterator[tuple[FieldLayout, int, int]]:
    """Yield the layouts that outputs have, and the numbers of those with heatmaps and fields."""
    channels = [output.shape[1] if len(output.shape) == 4 else None for output in outputs]
    last = {count: number for number, count in enumerate(channels)}
    for layout in LAYOUTS:
        both = layout.heat + layout.fields
        if both in last:
            yield layout, last[both], last[both]
        elif layout.heat in last and layout.fields in last:
            yield layout, last[layout.heat], last[layout.fields]
