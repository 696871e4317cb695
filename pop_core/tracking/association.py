"""Which detection is which tracked person: predicted joints, masks and size, solved together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import linear_sum_assignment

from pop_core.body.joints import SHARED_INDEX, SHARED_MIRROR
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.skeleton import BONES

UNSURE_M = 1.5  # doubt of a prediction beyond which it says nothing
MASK_WORTH_M = 0.15  # a detection within a person's pixels is as good as this much nearer
SIZE_WORTH_M = 0.6  # per unit of log size
SIZE_SIGMA = 0.12  # two lifted skeletons of one person differ by this [log size]
FEWEST_BONES = 3
COVERED_WORTH_M = 0.1  # a joint that is known across its ray only is as good as this far off
OWN_OVERLAP = 0.5  # share of keypoints without depth on a person's pixels: it is them
NO_MATCH = 1e6
BONE_ENDS = np.array([(SHARED_INDEX[a], SHARED_INDEX[b]) for a, b, _ in BONES])


@dataclass(frozen=True, slots=True, eq=False)
class Expected:
    """Where a tracked person should be.

    Args:
        points: The 15 shared points [m], camera frame.
        doubt_m: Standard deviation of the whole person's place.
        mask: Pixels of the person in the last frame.
        cover: Pixels of people who stand nearer: what is lifted there may be theirs; None for
            nobody.
    """

    points: Float[np.ndarray, 's 3']
    doubt_m: float
    mask: Bool[np.ndarray, 'h w']
    cover: Bool[np.ndarray, 'h w'] | None = None


def behind_others(people: Sequence[Expected]) -> list[Expected]:
    """Return people with the pixels of all who stand nearer than each of them."""
    out = list(people)
    cover: Bool[np.ndarray, 'h w'] | None = None
    for row in np.argsort([np.median(person.points[:, 2]) for person in people]).tolist():
        own = people[row].mask
        if cover is not None:
            out[row] = replace(people[row], cover=cover & ~own)
        cover = own if cover is None else cover | own
    return out


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
    # Whoever stays without a detection costs as much as the worst that could be theirs: nobody
    # takes another's to leave none over.
    alone = np.full((len(expected), len(expected)), NO_MATCH)
    np.fill_diagonal(alone, [MASK_WORTH_M + reach_m(person, gate_m) for person in expected])
    rows, columns = linear_sum_assignment(np.hstack([cost, alone]))
    return {
        int(row): int(column) for row, column in zip(rows, columns, strict=True)
        if column < len(detections) and cost[row, column] < NO_MATCH}


def reach_m(person: Expected, gate_m: float) -> float:
    """Return how far from the prediction a person may be found [m]."""
    return gate_m + 2.0 * min(person.doubt_m, UNSURE_M / 2.0)


def matching_cost(
    person: Expected, detection: Detection, lifted: LiftedJoints, gate_m: float
) -> float:
    """Return how badly a detection fits a person [m], `NO_MATCH` where it cannot be them.

    The median over joints: some limbs were lifted onto something else.
    """
    overlap = mask_overlap(person.mask, detection)
    if not lifted.lifted.any():
        return NO_MATCH if overlap < OWN_OVERLAP else MASK_WORTH_M * (2.0 - overlap)
    distance = offset_m(person, lifted)
    # Who is seen where somebody is, is hardly somebody else.
    if distance - MASK_WORTH_M * overlap > reach_m(person, gate_m):
        return NO_MATCH
    size = log_size(lifted, person.points)
    strange = max(0.0, abs(size) - SIZE_SIGMA)
    return distance + SIZE_WORTH_M * strange + MASK_WORTH_M * (1.0 - overlap)


def offset_m(person: Expected, lifted: LiftedJoints) -> float:
    """Return how far lifted joints lie from a person's, the median; 0 where none is lifted.

    Joints that were lifted onto somebody nearer tell their direction only; and left may have been
    taken for right.
    """
    rows = lifted.lifted
    if not rows.any():
        return 0.0
    return min(
        _median_offset_m(person, points[rows], lifted.positions_camera[rows],
                         lifted.keypoints_px[rows])
        for points in (person.points, person.points[SHARED_MIRROR]))


def _median_offset_m(
    person: Expected, points: Float[np.ndarray, 'n 3'], found: Float[np.ndarray, 'n 3'],
    uv: Float[np.ndarray, 'n 2'],
) -> float:
    """Return the median distance between a person's points and where they were found [m]."""
    distance = np.linalg.norm(points - found, axis=1)
    if person.cover is not None:
        covered = _on_mask(person.cover, uv)
        along = found / np.linalg.norm(found, axis=1, keepdims=True)
        across = points - np.einsum('nc,nc->n', points, along)[:, None] * along
        aside = COVERED_WORTH_M + np.linalg.norm(across, axis=1)
        distance = np.where(covered, np.minimum(distance, aside), distance)
    return float(np.median(distance))


def mask_overlap(mask: Bool[np.ndarray, 'h w'], detection: Detection) -> float:
    """Return the share of a detection's keypoints that lie on a mask."""
    uv = detection.keypoints_px[np.isfinite(detection.keypoints_px).all(axis=1)]
    return float(_on_mask(mask, uv).mean()) if len(uv) else 0.0


def _on_mask(
    mask: Bool[np.ndarray, 'h w'], uv: Float[np.ndarray, 'n 2']
) -> Bool[np.ndarray, 'n']:
    u, v = np.clip(np.rint(uv), 0, np.array(mask.shape[::-1]) - 1).astype(np.int64).T
    return np.asarray(mask[v, u])


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
