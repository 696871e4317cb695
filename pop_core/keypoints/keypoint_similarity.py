"""How much two detections look like the same person: object keypoint similarity (Lin et al. 2014).

The similarity of one joint is exp(-d^2 / (2 s^2 k^2)) with the distance d [px], the size s of the
person, the root of its box's area [px], and the spread k of the joint.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import SHARED_NAMES
from pop_core.keypoints.boxes import box_areas, overlaps
from pop_core.keypoints.detection import Detection

# Twice the standard deviations of COCO's annotators. Pelvis and neck are as vague as hips and
# shoulders; the head is taken for the nose by some detectors and for its middle by others.
SPREAD = {
    'pelvis': 0.214, 'hip': 0.214, 'knee': 0.174, 'ankle': 0.178, 'neck': 0.158, 'head': 0.158,
    'shoulder': 0.158, 'elbow': 0.144, 'wrist': 0.124,
}
JOINT_SPREAD = np.array([SPREAD[name.split('_')[-1]] for name in SHARED_NAMES])
MIN_COMMON = 3  # joints; with fewer the boxes decide


def person_similarities(
    a: Sequence[Detection], b: Sequence[Detection]
) -> Float[np.ndarray, 'n m']:
    """Return the similarity 0..1 of every person of a with every one of b.

    It is the mean over the joints that both have; a joint counts as much as the less confident
    of both is sure of it.
    """
    if not a or not b:
        return np.zeros((len(a), len(b)))
    boxes_a, boxes_b = (np.stack([p.box_px for p in people]) for people in (a, b))
    scores_a, scores_b = (np.stack([p.scores for p in people]) for people in (a, b))
    uv_a, uv_b = (np.stack([p.keypoints_px for p in people]) for people in (a, b))
    weight = np.minimum(scores_a[:, None], scores_b[None])
    areas = np.maximum(box_areas(boxes_a)[:, None], box_areas(boxes_b)[None])
    similar = joint_similarity(uv_a[:, None], uv_b[None], _size_px(areas)[..., None])
    mean = (weight * similar).sum(axis=-1) / np.maximum(weight.sum(axis=-1), 1e-9)
    enough = np.count_nonzero(weight, axis=-1) >= MIN_COMMON
    return np.where(enough, mean, overlaps(boxes_a, boxes_b))


def joint_similarity(
    a: Float[np.ndarray, '*#n s 2'],
    b: Float[np.ndarray, '*#n s 2'],
    size_px: float | Float[np.ndarray, '*#n 1'],
) -> Float[np.ndarray, '*#n s']:
    """Return the similarity 0..1 of each joint; 0 where one of both is unknown."""
    squared = ((a - b) ** 2).sum(axis=-1)
    similar = np.exp(-squared / (2.0 * (size_px * JOINT_SPREAD) ** 2))
    return np.nan_to_num(similar)


def common_size_px(people: Sequence[Detection]) -> float:
    """Return the size of a person seen several times; who is seen in part has a smaller box."""
    return float(_size_px(box_areas(np.stack([person.box_px for person in people]))).max())


def _size_px(areas: Float[np.ndarray, '*n']) -> Float[np.ndarray, '*n']:
    return np.maximum(np.sqrt(areas), 1.0)
