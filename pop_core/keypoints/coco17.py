"""From COCO's 17 keypoints to the 15 shared joints."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import COCO_17_NAMES, N_SHARED, SHARED_INDEX
from pop_core.keypoints.neck import with_smpl_neck

_ROW = {name: row for row, name in enumerate(COCO_17_NAMES)}
_SAME = tuple(name for name in SHARED_INDEX if name in _ROW)
# COCO marks neither: they are taken midway between hips and between shoulders.
_MIDWAY = {'pelvis': ('left_hip', 'right_hip'), 'neck': ('left_shoulder', 'right_shoulder')}


def shared_from_coco17(
    keypoints_px: Float[np.ndarray, '17 2'], scores: Float[np.ndarray, '17']
) -> tuple[Float[np.ndarray, 's 2'], Float[np.ndarray, 's']]:
    """Return pixels and scores of the 15 shared joints; a midpoint is as sure as its worse end."""
    shared_px = np.full((N_SHARED, 2), np.nan)
    shared_scores = np.zeros(N_SHARED)
    pairs = {name: (name, name) for name in _SAME} | {'head': ('nose', 'nose')} | _MIDWAY
    for name, (first, second) in pairs.items():
        a, b = _ROW[first], _ROW[second]
        score = min(scores[a], scores[b])
        if score > 0:
            shared_px[SHARED_INDEX[name]] = 0.5 * (keypoints_px[a] + keypoints_px[b])
            shared_scores[SHARED_INDEX[name]] = score
    return with_smpl_neck(shared_px), shared_scores
