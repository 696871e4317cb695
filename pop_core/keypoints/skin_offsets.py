"""How far behind the skin, along the ray, each joint lies [m]: measured on the default body.

`scripts/measure_skin_offsets.py` renders clothed default bodies in varied poses and compares the
depth at each joint with the joint itself; it prints the table below.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import SHARED_INDEX, SHARED_NAMES

# Metres for a body of scale 1: seen from the front, the side and the back, then the spread about
# them. The nose stands before the face that fills its patch; from behind, the cheek does.
_TABLE = {
    'pelvis': (0.171, 0.209, 0.135, 0.028),
    'hip': (0.151, 0.084, 0.113, 0.038),
    'knee': (0.073, 0.068, 0.079, 0.016),
    'ankle': (0.058, 0.039, 0.048, 0.009),
    'neck': (0.074, 0.083, 0.077, 0.025),
    'head': (-0.020, 0.023, 0.090, 0.025),
    'shoulder': (0.075, 0.060, 0.084, 0.024),
    'elbow': (0.051, 0.036, 0.047, 0.016),
    'wrist': (0.026, 0.025, 0.028, 0.009),
}
_ROWS = np.array([_TABLE[name.split('_')[-1]] for name in SHARED_NAMES])
SHOULDER_WIDTH_M, HIP_WIDTH_M = 0.34, 0.20
_PAIRS = (('shoulder', SHOULDER_WIDTH_M), ('hip', HIP_WIDTH_M))


def facing(
    keypoints_px: Float[np.ndarray, 's 2'], metres_per_px: float
) -> float | None:
    """Return how much a person faces the camera: 1 the front, 0 a side, -1 the back.

    It is the signed width of shoulders and hips across the trunk, relative to their true width:
    the left shoulder of somebody facing the camera is on the right of the image.

    Args:
        keypoints_px: Pixels of the shared joints; NaN where unknown.
        metres_per_px: Size of a pixel at the person, divided by the person's scale [m].

    Returns:
        The facing in -1..1; None when neither pair is known.
    """
    down = _trunk_down(keypoints_px)
    shares = []
    for name, width_m in _PAIRS:
        left, right = SHARED_INDEX[f'left_{name}'], SHARED_INDEX[f'right_{name}']
        across = keypoints_px[left] - keypoints_px[right]
        shares.append((down[1] * across[0] - down[0] * across[1]) * metres_per_px / width_m)
    known = [share for share in shares if np.isfinite(share)]
    return float(np.clip(np.mean(known), -1.0, 1.0)) if known else None


def skin_to_joint_m(facing_share: float | None) -> tuple[
    Float[np.ndarray, 's'], Float[np.ndarray, 's']
]:
    """Return distance from skin to joint along the ray and its spread [m], for scale 1."""
    front, side, back, spread = _ROWS.T
    if facing_share is None:
        three = _ROWS[:, :3]
        return three.mean(axis=1), np.hypot(spread, three.std(axis=1))
    turned = 1.0 - abs(facing_share)
    towards, away = max(facing_share, 0.0), max(-facing_share, 0.0)
    return towards * front + turned * side + away * back, spread.copy()


def _trunk_down(keypoints_px: Float[np.ndarray, 's 2']) -> Float[np.ndarray, '2']:
    """Return the unit direction from neck to pelvis in the image; straight down if unknown."""
    trunk = keypoints_px[SHARED_INDEX['pelvis']] - keypoints_px[SHARED_INDEX['neck']]
    length = np.linalg.norm(trunk)
    return trunk / length if length > 1.0 else np.array([0.0, 1.0])
