"""Detections made of bare keypoints: undetected ones become NaN, the box is drawn around."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.keypoints.detection import Detection

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
