"""Which detection is which tracked person: predicted joints, masks and size, solved together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import linear_sum_assignment

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.skeleton import BONES

UNSURE_M = 1.5  # doubt of a prediction beyond which it says nothing
MASK_WORTH_M = 0.15  # a detection within a person's pixels is as good as this much nearer
SIZE_WORTH_M = 0.6  # per unit of log size
SIZE_SIGMA = 0.12  # two lifted skeletons of one person differ by this [log size]
FEWEST_BONES = 3
NO_MATCH = 1e6
BONE_ENDS = np.array([(SHARED_INDEX[a], SHARED_INDEX[b]) for a, b, _ in BONES])


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """Where a tracked person should be.

    Args:
        points: The 15 shared points [m], camera frame.
        doubt_m: Standard deviation of the whole person's place.
        mask: Pixels of the person in the last frame.
    """

    points: Float[np.ndarray, 's 3']
    doubt_m: float
    mask: Bool[np.ndarray, 'h w']


def associate(
    expected: Sequence[Expected], detections: Sequence[Detection],
    lifted: Sequence[LiftedJoints], gate_m: float,
) -> dict[int, int]:
    """Return the detection of each person who has one, by the cheapest assignment of all.

    Args:
        expected: The tracked people.
        detections: People found in the image.
        lifted: Their joints in 3D.
        gate_m: Farthest distance of a person whose place is known exactly [m].
    """
    cost = np.full((len(expected), len(detections)), NO_MATCH)
    for row, person in enumerate(expected):
        for column, (detection, joints) in enumerate(zip(detections, lifted, strict=True)):
            cost[row, column] = matching_cost(person, detection, joints, gate_m)
    rows, columns = linear_sum_assignment(cost)
    return {
        int(row): int(column) for row, column in zip(rows, columns, strict=True)
        if cost[row, column] < NO_MATCH}


def matching_cost(
    person: Expected, detection: Detection, lifted: LiftedJoints, gate_m: float
) -> float:
    """Return how badly a detection fits a person [m], `NO_MATCH` where it cannot be them.

    The median over joints: some limbs were lifted onto something else.
    """
    overlap = mask_overlap(person.mask, detection)
    if not lifted.lifted.any():
        return NO_MATCH if overlap < 0.5 else MASK_WORTH_M * (2.0 - overlap)
    distance = offset_m(person, lifted)
    if distance > gate_m + 2.0 * min(person.doubt_m, UNSURE_M / 2.0):
        return NO_MATCH
    size = log_size(lifted, person.points)
    strange = max(0.0, abs(size) - SIZE_SIGMA)
    return distance + SIZE_WORTH_M * strange + MASK_WORTH_M * (1.0 - overlap)


def offset_m(person: Expected, lifted: LiftedJoints) -> float:
    """Return how far lifted joints lie from a person's, the median; 0 where none is lifted."""
    rows = lifted.lifted
    if not rows.any():
        return 0.0
    offset = np.linalg.norm(person.points[rows] - lifted.positions_camera[rows], axis=1)
    return float(np.median(offset))


def mask_overlap(mask: Bool[np.ndarray, 'h w'], detection: Detection) -> float:
    """Return the share of a detection's keypoints that lie on a mask."""
    uv = detection.keypoints_px[np.isfinite(detection.keypoints_px).all(axis=1)]
    u, v = np.clip(np.rint(uv), 0, np.array(mask.shape[::-1]) - 1).astype(np.int64).T
    return float(mask[v, u].mean()) if len(uv) else 0.0


def log_size(lifted: LiftedJoints, points: Float[np.ndarray, 's 3']) -> float:
    """Return the log of how much longer lifted bones are than a person's; 0 with few bones."""
    known = lifted.lifted[BONE_ENDS].all(axis=1)
    if known.sum() < FEWEST_BONES:
        return 0.0
    ends = BONE_ENDS[known]
    measured, own = (
        np.linalg.norm(p[ends[:, 0]] - p[ends[:, 1]], axis=1)
        for p in (lifted.positions_camera, points))
    return float(np.log(np.maximum(np.median(measured / np.maximum(own, 1e-3)), 1e-3)))
