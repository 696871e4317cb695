"""Whether limbs keep clear of trunk, head and each other, judged from 15 joints [m]."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import SHARED_INDEX

SAMPLES = np.linspace(0.0, 1.0, 5)
SIDES = ('left', 'right')
Bone = tuple[str, str]


def _clearances() -> list[tuple[Bone, Bone, float]]:
    """Return pairs of bones and the smallest distance of their axes [m]; flesh gives way."""
    trunk, face = ('pelvis', 'neck'), ('neck', 'head')
    pairs: list[tuple[Bone, Bone, float]] = []
    for side in SIDES:
        forearm = (f'{side}_elbow', f'{side}_wrist')
        pairs.append((forearm, trunk, 0.125))
        pairs.append(((f'{side}_wrist', f'{side}_wrist'), face, 0.10))
        pairs.append(((f'{side}_knee', f'{side}_knee'), trunk, 0.15))
        for other in SIDES:
            pairs.append((forearm, (f'{other}_hip', f'{other}_knee'), 0.085))
            pairs.append((forearm, (f'{other}_knee', f'{other}_ankle'), 0.07))
    pairs.append((('left_elbow', 'left_wrist'), ('right_elbow', 'right_wrist'), 0.035))
    pairs.append((('left_knee', 'left_ankle'), ('right_knee', 'right_ankle'), 0.085))
    pairs.append((('left_knee', 'left_ankle'), ('right_hip', 'right_knee'), 0.10))
    pairs.append((('right_knee', 'right_ankle'), ('left_hip', 'left_knee'), 0.10))
    return pairs


CLEARANCES = _clearances()


def limbs_clear(joints: Float[np.ndarray, 'n s 3']) -> Bool[np.ndarray, 'n']:
    """Return which poses (15 shared joints [m]) run no limb through the body."""
    clear = np.ones(len(joints), dtype=bool)
    for first, second, apart_m in CLEARANCES:
        a, b = (_along(joints, *bone) for bone in (first, second))
        gap2 = np.sum((a[:, :, None] - b[:, None]) ** 2, axis=3).min(axis=(1, 2))
        clear &= gap2 > apart_m**2
    return clear


def _along(
    joints: Float[np.ndarray, 'n s 3'], start: str, end: str
) -> Float[np.ndarray, 'n k 3']:
    """Return points along the bone between two joints; one point when they are the same."""
    a, b = joints[:, SHARED_INDEX[start]], joints[:, SHARED_INDEX[end]]
    share = SAMPLES[:1] if start == end else SAMPLES
    return np.asarray(a[:, None] + share[:, None] * (b - a)[:, None])
