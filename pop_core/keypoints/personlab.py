"""PersonLab networks: several people, bottom-up (Papandreou et al. 2018), e.g. Coral's PoseNet.

Outputs, on a grid whose corners are the corner pixels of the input: heatmap logits (h, w, 17);
short offsets to the keypoint (h, w, 2 [y, x], 17) [px]; mid offsets along the 16 edges of the
skeleton (h, w, 2 [forward, backward], 2 [y, x], 16) [px]. Input: RGB, uint8, NHWC.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float, Float32, UInt8

from pop_core.keypoints import personlab_kernels as kernels
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.keypoint_sets import COCO_17, shared_joints
from pop_core.keypoints.letterbox import letterbox
from pop_core.keypoints.network import NetworkSpec, Run, Tensor, check_grid
from pop_core.keypoints.people import detection_of

# The edges of the skeleton, by COCO index, in the order of the network's channels.
EDGES = np.array([
    (0, 1), (1, 3), (0, 2), (2, 4), (0, 5), (5, 7), (7, 9), (5, 11), (11, 13), (13, 15),
    (0, 6), (6, 8), (8, 10), (6, 12), (12, 14), (14, 16),
])
N_KEYPOINTS = kernels.N_KEYPOINTS
# Codes of the quantised network: value = (code - zero) * step.
HEAT_ZERO, HEAT_STEP = 128.0, 0.0784313753
MID_ZERO, MID_STEP = 117.0, 1.3875764608
SEED_SCORE = 0.5
PERSON_SCORE = 0.1
NMS_SHARE = 0.04  # of the input's diagonal, as 40 px of 641 x 481 in the paper's demo
# Codes end at 10 px, and the disc of cells that know a keypoint is 32 px wide: two steps, as in
# the paper, leave elbows 14 cm off.
REFINEMENTS = 5
MOST_SEEDS = 2000  # a hundred people have as many; a map of nothing but maxima has more
LARGE_PX = 1e4  # beyond any place in an input, and a logit of certainty


@dataclass(frozen=True, slots=True, eq=False)
class PersonLabMaps:
    """Outputs as values.

    Args:
        scores: Probability of each keypoint per cell.
        short: Offset from a cell to the keypoint [px].
        mid: Offset along each edge [px].
        stride: Pixels per cell.
    """

    scores: Float32[np.ndarray, 'h w 17']
    short: Float32[np.ndarray, 'h w 2 17']
    mid: Float32[np.ndarray, 'h w 2 2 16']
    stride: float


class PersonLabDecoder:
    """Runs on the whole image, padded to the network's size."""

    name: ClassVar[str] = 'personlab'
    expects: ClassVar[str] = (
        'one input (1, h, w, 3) uint8 -> heatmaps (1, h, w, 17), short offsets (1, h, w, 34), '
        'mid offsets (1, h, w, 64), all uint8 or all float32'
    )

    def __init__(self, spec: NetworkSpec) -> None:
        """Keep the input's size and the order of the outputs."""
        _, height, width, _ = spec.inputs[0].shape
        self.height, self.width = int(height or 0), int(width or 0)
        channels = [output.shape[-1] for output in spec.outputs]
        self.order = [channels.index(count) for count in (17, 34, 64)]

    @classmethod
    def fits(cls, spec: NetworkSpec) -> bool:
        """Return whether inputs and outputs are those of `expects`."""
        if len(spec.inputs) != 1 or len(spec.outputs) != 3:
            return False
        shape, kinds = spec.inputs[0].shape, {output.dtype for output in spec.outputs}
        image = len(shape) == 4 and None not in shape and shape[0] == 1 and shape[3] == 3
        maps = all(len(output.shape) == 4 for output in spec.outputs)
        return bool(
            image and maps and spec.inputs[0].dtype == 'uint8'
            and sorted(output.shape[-1] or 0 for output in spec.outputs) == [17, 34, 64]
            and kinds in ({'uint8'}, {'float32'}))

    def detect(self, rgb: UInt8[np.ndarray, 'h w 3'], run: Run) -> list[Detection]:
        """Return the people of an image, best first."""
        image, placed = letterbox(rgb, self.height, self.width)
        outputs = run(image[None])
        maps = read_maps([outputs[i] for i in self.order], self.width)
        detections = []
        for person in decode_people(maps, NMS_SHARE * float(np.hypot(self.width, self.height))):
            uv = placed.to_image(person[:, 1::-1])
            keypoints_px, scores = shared_joints(COCO_17, uv, person[:, 2])
            if scores.any():
                detections.append(detection_of(keypoints_px, scores))
        return detections


def read_maps(outputs: Sequence[Tensor], width: int) -> PersonLabMaps:
    """Return heatmaps, short and mid offsets as values; codes are decoded where they are uint8.

    Raises:
        NetworkShapeError: If they lie on different grids.
    """
    # The kernels look up one map by the cells of another, and check no bounds.
    check_grid('personlab', [output[0, ..., 0] for output in outputs])
    # What is no number decides nothing: without a score it seeds nobody.
    heat, short, mid = (
        np.nan_to_num(output[0].astype(np.float32), nan=-LARGE_PX, posinf=LARGE_PX,
                      neginf=-LARGE_PX).clip(-LARGE_PX, LARGE_PX) for output in outputs)
    if outputs[0].dtype == np.uint8:
        heat = (heat - HEAT_ZERO) * HEAT_STEP
        short = (short - HEAT_ZERO) * HEAT_STEP
        mid = (mid - MID_ZERO) * MID_STEP
    h, w = heat.shape[:2]
    return PersonLabMaps(
        (1.0 / (1.0 + np.exp(-np.clip(heat, -50.0, 50.0)))).astype(np.float32),
        short.reshape(h, w, 2, N_KEYPOINTS).astype(np.float32),
        mid.reshape(h, w, 2, 2, len(EDGES)).astype(np.float32),
        (width - 1) / (w - 1))


def decode_people(maps: PersonLabMaps, nms_radius_px: float) -> list[Float[np.ndarray, '17 3']]:
    """Return people as (y, x, score) per COCO keypoint [network px], best first.

    Seeds are taken by falling score; one that lies on the same keypoint of a person already
    found belongs to that person. A person's score counts only keypoints that nobody has yet.
    """
    cells = kernels.local_maxima(maps.scores, SEED_SCORE)
    strength = maps.scores[cells[:, 0], cells[:, 1], cells[:, 2]]
    cells = cells[np.argsort(-strength, kind='stable')][:MOST_SEEDS]
    people: list[Float[np.ndarray, '17 3']] = []
    worth: list[float] = []
    for row, column, j in cells:
        y, x = kernels.refined(
            row * maps.stride, column * maps.stride, j, maps.short, maps.stride, REFINEMENTS)
        if any(np.hypot(p[j, 0] - y, p[j, 1] - x) <= nms_radius_px for p in people):
            continue
        person = np.zeros((N_KEYPOINTS, 3))
        kernels.grow_person(
            y, x, j, maps.scores, maps.short, maps.mid, EDGES, maps.stride,
            REFINEMENTS, person)
        own = np.ones(N_KEYPOINTS, dtype=bool)
        for other in people:
            own &= np.hypot(*(other[:, :2] - person[:, :2]).T) > nms_radius_px
        score = float(person[own, 2].sum()) / N_KEYPOINTS
        if score >= PERSON_SCORE:
            people.append(person)
            worth.append(score)
    return [people[i] for i in np.argsort(-np.array(worth), kind='stable')]
