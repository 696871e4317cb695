"""The neck that detectors mark, between the shoulders, and SMPL's, a hand's width above it.

Both ways need only other keypoints of the same image, so that a file written in the detectors'
convention reads back unchanged. Some writers project SMPL's own neck into the detectors' format;
the shoulders tell the two apart.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import SHARED_INDEX

# On the default body: neck to pelvis relative to mid-shoulder to pelvis, and the share of the way
# from mid-shoulder to nose, seen from the front.
ABOVE_PELVIS = 0.54 / 0.444
TOWARD_NOSE = 0.45
HALF_WAY = 0.5 * (ABOVE_PELVIS - 1.0)  # between both conventions, relative to the torso
_NECK, _PELVIS, _NOSE = (SHARED_INDEX[name] for name in ('neck', 'pelvis', 'head'))
_SHOULDERS = [SHARED_INDEX[f'{side}_shoulder'] for side in ('left', 'right')]


def with_smpl_neck(keypoints_px: Float[np.ndarray, 's 2']) -> Float[np.ndarray, 's 2']:
    """Return keypoints whose neck, given between the shoulders, lies where SMPL has it.

    It is moved away from the pelvis; without a pelvis toward the nose; without either not at all.
    A neck that already stands well above the shoulders stays where it is.

    Args:
        keypoints_px: Pixels of the 15 shared joints; NaN where undetected.
    """
    out = keypoints_px.copy()
    if _stands_above_shoulders(keypoints_px):
        return out
    neck, pelvis, nose = keypoints_px[[_NECK, _PELVIS, _NOSE]]
    if np.isfinite(pelvis).all():
        out[_NECK] = pelvis + ABOVE_PELVIS * (neck - pelvis)
    elif np.isfinite(nose).all():
        out[_NECK] = neck + TOWARD_NOSE * (nose - neck)
    return out


def with_detector_neck(keypoints_px: Float[np.ndarray, 's 2']) -> Float[np.ndarray, 's 2']:
    """Return keypoints whose neck lies between the shoulders: undoes `with_smpl_neck`."""
    out = keypoints_px.copy()
    neck, pelvis, nose = keypoints_px[[_NECK, _PELVIS, _NOSE]]
    if np.isfinite(pelvis).all():
        out[_NECK] = pelvis + (neck - pelvis) / ABOVE_PELVIS
    elif np.isfinite(nose).all():
        out[_NECK] = (neck - TOWARD_NOSE * nose) / (1.0 - TOWARD_NOSE)
    return out


def _stands_above_shoulders(keypoints_px: Float[np.ndarray, 's 2']) -> bool:
    """Return whether the neck is nearer to SMPL's place than to the middle of the shoulders."""
    shoulders = keypoints_px[_SHOULDERS].mean(axis=0)
    up = shoulders - keypoints_px[_PELVIS]
    with np.errstate(invalid='ignore', divide='ignore'):
        above = (keypoints_px[_NECK] - shoulders) @ up / (up @ up)
    return bool(above > HALF_WAY)
