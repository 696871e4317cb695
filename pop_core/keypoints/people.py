"""Detections made of bare keypoints: undetected ones become NaN, the box is drawn around."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from pop_core.keypoints.detection import Detection
from pop_core.keypoints.keypoint_sets import KeypointSet, shared_joints

# Head top, hands and toes lie outside the keypoints by about this share of the person's extent.
BOX_MARGIN = 0.15


def detection_of(
    keypoints_px: Float[np.ndarray, 's 2'], scores: Float[np.ndarray, 's']
) -> Detection:
    """Return a person of pixels and scores 0..1; a score of 0 means not detected.

    Raises:
        ValueError: If nothing is detected.
    """
    found = (scores > 0) & np.isfinite(keypoints_px).all(axis=1)
    if not found.any():
        raise ValueError('expected at least one keypoint with a score above 0, found none')
    px = np.where(found[:, None], keypoints_px, np.nan).astype(np.float64)
    low, high = px[found].min(axis=0), px[found].max(axis=0)
    margin = BOX_MARGIN * float((high - low).max())
    box_px = np.concatenate([low - margin, high + margin])
    return Detection(px, np.where(found, scores, 0.0).astype(np.float64), box_px)


def detections_of(
    keypoints: KeypointSet,
    people: Iterable[tuple[Float[np.ndarray, 'k 2'], Float[np.ndarray, 'k']]],
) -> list[Detection]:
    """Return people whose keypoints are of a set, best first.

    Who shows none of the shared joints, only ears, say, is nobody.

    Args:
        keypoints: The set.
        people: Pixels (u, v) and scores 0..1 of each person's keypoints.
    """
    shared = [shared_joints(keypoints, uv, scores) for uv, scores in people]
    found = [detection_of(uv, scores) for uv, scores in shared if scores.any()]
    return sorted(found, key=lambda person: -person.score)
