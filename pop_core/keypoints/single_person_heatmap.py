"""One person per image by heatmaps of MPII's 16 joints, e.g. EfficientPose (Groos et al. 2021).

Input: RGB / 255, ImageNet mean and standard deviation, float32, NHWC. Output: one map per joint;
of several outputs the finest is read. The network looks into the boxes of other sources; without
them at the whole image, then once more at the person when that fills less than half of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Float32, UInt8

from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.keypoint_sets import MPII_16, shared_joints
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run, check_grid
from pop_core.keypoints.network_input import IMAGENET, planes
from pop_core.keypoints.people import detection_of

MIN_PEAK = 0.2
MIN_KEYPOINTS = 4
SMALL_PERSON = 0.5  # of the image's longer side
CROP_MARGIN = 0.2
PEAK_RADIUS = 0.012  # of the map's height: cells averaged around the largest


class SinglePersonHeatmapDecoder:
    """Finds the one person of an image, or of each box."""

    name: ClassVar[str] = 'single_person_heatmap'
    expects: ClassVar[str] = (
        'one input (1, h, w, 3) float32 -> heatmaps (1, h, w, 16) of MPII joints, float32'
    )

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and which output is the finest."""
        _, height, width, _ = spec.inputs[0].shape
        self.height, self.width = int(height or 0), int(width or 0)
        rows = [
            (o.shape[1] or 1) if len(o.shape) == 4 and o.shape[-1] == len(MPII_16) else 0
            for o in spec.outputs
        ]
        self.output = int(np.argmax(rows))

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        if len(spec.inputs) != 1 or spec.inputs[0].dtype != 'float32':
            return False
        shape = spec.inputs[0].shape
        image = len(shape) == 4 and None not in shape and shape[0] == 1 and shape[3] == 3
        return image and any(
            len(output.shape) == 4 and output.shape[-1] == len(MPII_16)
            and output.dtype == 'float32' for output in spec.outputs)

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the person of an image, or nobody."""
        person = self._look(rgb, run)
        if person is None:
            return []
        region = _crop(person.box_px, rgb.shape[0], rgb.shape[1])
        if region is None or _longer_side(region) > SMALL_PERSON * max(rgb.shape[:2]):
            return [person]
        closer = self._look_into(rgb, person.box_px, run)
        return [person if closer is None else closer]

    def detect_in(
        self, rgb: UInt8[np.ndarray, 'h w 3'], boxes: Sequence[PersonBox], run: Run
    ) -> list[Detection]:
        """Return one person for every box in which one is seen."""
        found = (self._look_into(rgb, box.box_px, run) for box in boxes)
        return [person for person in found if person is not None]

    def _look_into(
        self, rgb: UInt8[np.ndarray, 'h w 3'], box_px: Float[np.ndarray, '4'], run: Run
    ) -> Detection | None:
        region = _crop(box_px, rgb.shape[0], rgb.shape[1])
        if region is None:
            return None
        left, top, right, bottom = region
        person = self._look(np.ascontiguousarray(rgb[top:bottom, left:right]), run)
        if person is None:
            return None
        return detection_of(person.keypoints_px + [left, top], person.scores)

    def _look(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> Detection | None:
        image, placed = letterbox(rgb, self.height, self.width)
        tensor = np.ascontiguousarray(planes(image, IMAGENET).transpose(0, 2, 3, 1))
        heat = np.nan_to_num(run(tensor)[self.output][0].astype(np.float32))
        check_grid(self.name, [heat[..., 0]])
        cells, peaks = heatmap_peaks(heat)
        # A map's cell covers several pixels; its centre lies in the middle of them.
        factor = np.array([self.width / heat.shape[1], self.height / heat.shape[0]])
        uv = placed.to_image((cells + 0.5) * factor - 0.5)
        inside = np.all((uv >= -0.5) & (uv < [rgb.shape[1] - 0.5, rgb.shape[0] - 0.5]), axis=1)
        found = np.where(inside & (peaks >= MIN_PEAK), peaks, 0.0)
        keypoints_px, scores = shared_joints(MPII_16, uv, found)
        if np.count_nonzero(scores) < MIN_KEYPOINTS:
            return None
        return detection_of(keypoints_px, scores)


def heatmap_peaks(
    heat: Float32[np.ndarray, 'h w k'],
) -> tuple[Float[np.ndarray, 'k 2'], Float[np.ndarray, 'k']]:
    """Return the place (u, v) of each map's peak [cells], finer than a cell, and its height."""
    h, w, k = heat.shape
    radius = max(1, round(PEAK_RADIUS * h))
    places, heights = np.zeros((k, 2)), np.zeros(k)
    for channel in range(k):
        v, u = np.unravel_index(int(heat[..., channel].argmax()), (h, w))
        rows = slice(max(0, v - radius), min(h, v + radius + 1))
        columns = slice(max(0, u - radius), min(w, u + radius + 1))
        weight = np.maximum(heat[rows, columns, channel], 0.0).astype(np.float64)
        vv, uu = np.mgrid[rows, columns]
        total = max(float(weight.sum()), 1e-9)
        places[channel] = (weight * uu).sum() / total, (weight * vv).sum() / total
        heights[channel] = heat[v, u, channel]
    return places, heights


def _longer_side(region: tuple[int, int, int, int]) -> int:
    left, top, right, bottom = region
    return max(right - left, bottom - top)


def _crop(
    box_px: Float[np.ndarray, '4'], height: int, width: int
) -> tuple[int, int, int, int] | None:
    """Return whole pixels (left, top, right, bottom) of a box with some room around it.

    None where the box and the image have no pixel in common.
    """
    if not np.isfinite(box_px).all():
        return None
    margin = CROP_MARGIN * max(box_px[2] - box_px[0], box_px[3] - box_px[1])
    low = np.clip(np.floor(box_px[:2] - margin), 0, [width, height])
    high = np.clip(np.ceil(box_px[2:] + margin), 0, [width, height])
    if not (low < high).all():
        return None
    return int(low[0]), int(low[1]), int(high[0]), int(high[1])
