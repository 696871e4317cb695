"""How much two detections look like the same person: object keypoint similarity (Lin et al. 2014).

The similarity of one joint is exp(-d^2 / (2 s^2 k^2)) with the distance d [px], the size s of the
person, the root of its box's area [px], and the spread k of the joint.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import MIRROR, SHARED_MIRROR, SHARED_NAMES
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


def person_similarity(a: Detection, b: Detection) -> float:
    """Return the similarity 0..1 of two people over the joints that both have.

    A joint counts as much as the less confident of both is sure of it.
    """
    weight = np.minimum(a.scores, b.scores)
    if np.count_nonzero(weight) < MIN_COMMON:
        return float(overlaps(a.box_px[None], b.box_px[None])[0, 0])
    similar = joint_similarity(a.keypoints_px, b.keypoints_px, common_size_px(a, b))
    return float(weight @ similar / weight.sum())


def joint_similarity(
    a: Float[np.ndarray, '*n s 2'], b: Float[np.ndarray, 's 2'], size_px: float
) -> Float[np.ndarray, '*n s']:
    """Return the similarity 0..1 of each joint; 0 where one of both is unknown."""
    squared = ((a - b) ** 2).sum(axis=-1)
    similar = np.exp(-squared / (2.0 * (size_px * JOINT_SPREAD) ** 2))
    return np.nan_to_num(similar)


def common_size_px(a: Detection, b: Detection) -> float:
    """Return the size of the person: who is seen in part has the smaller box, not the size."""
    areas = box_areas(np.stack([a.box_px, b.box_px]))
    return max(1.0, float(np.sqrt(areas.max())))


def mirrored(a: Detection) -> Detection:
    """Return a person with left and right exchanged."""
    def swap(values: Float[np.ndarray, 's'] | None) -> Float[np.ndarray, 's'] | None:
        return None if values is None else values[SHARED_MIRROR]

    labels = a.part_labels
    if labels is not None:
        labels = np.where(labels >= 0, MIRROR[labels], labels).astype(np.int8)
    return Detection(
        a.keypoints_px[SHARED_MIRROR], a.scores[SHARED_MIRROR], a.box_px, swap(a.joint_depth_m),
        swap(a.joint_sigma_m), swap(a.visible), a.person_mask, labels)
