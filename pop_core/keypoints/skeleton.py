"""The 15 shared joints as a tree of bones with lengths [m] of the mean default body."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import SHARED_INDEX

ROOT = 'pelvis'
# (joint, parent, mean length [m]); the head's bone ends at the nose. Parents before children.
BONES = (
    ('neck', ROOT, 0.541),
    ('head', 'neck', 0.182),
    ('left_hip', ROOT, 0.113),
    ('right_hip', ROOT, 0.113),
    ('left_shoulder', 'neck', 0.200),
    ('right_shoulder', 'neck', 0.200),
    ('left_knee', 'left_hip', 0.379),
    ('right_knee', 'right_hip', 0.379),
    ('left_elbow', 'left_shoulder', 0.257),
    ('right_elbow', 'right_shoulder', 0.257),
    ('left_ankle', 'left_knee', 0.433),
    ('right_ankle', 'right_knee', 0.433),
    ('left_wrist', 'left_elbow', 0.230),
    ('right_wrist', 'right_elbow', 0.230),
)
ORDER = np.array([SHARED_INDEX[ROOT], *(SHARED_INDEX[bone[0]] for bone in BONES)])
TREE_PARENT = np.full(len(ORDER), -1)
BONE_M = np.full(len(ORDER), np.nan)  # to the parent; NaN for the root
for _joint, _parent, _length in BONES:
    TREE_PARENT[SHARED_INDEX[_joint]] = SHARED_INDEX[_parent]
    BONE_M[SHARED_INDEX[_joint]] = _length


def _path_lengths() -> Float[np.ndarray, 's s']:
    """Return the length of the path between any two joints, along mean bones [m]."""
    path = np.zeros((len(ORDER), len(ORDER)))
    for k, j in enumerate(ORDER[1:], start=1):
        others = ORDER[:k]
        path[j, others] = path[others, j] = path[TREE_PARENT[j], others] + BONE_M[j]
    return path


PATH_M = _path_lengths()
TORSO = np.array([
    SHARED_INDEX[name] for name in
    ('pelvis', 'neck', 'left_hip', 'right_hip', 'left_shoulder', 'right_shoulder')
])
HIPS = np.array([SHARED_INDEX['left_hip'], SHARED_INDEX['right_hip']])
LEGS = np.array([
    SHARED_INDEX[f'{side}_{name}'] for side in ('left', 'right') for name in ('knee', 'ankle')
])
# Joints whose left and right are easily taken for one.
LIMB_ENDS = np.array([
    SHARED_INDEX[f'{side}_{name}'] for side in ('left', 'right')
    for name in ('knee', 'ankle', 'elbow', 'wrist')
])


def linked(present: Bool[np.ndarray, 's']) -> Int[np.ndarray, 's']:
    """Return each present joint's nearest present ancestor: the tree without the others.

    Where no ancestor is present, it is the first present joint; that one has none (-1).
    """
    rows = [int(j) for j in ORDER if present[j]]
    out = np.full(len(ORDER), -1)
    for j in rows[1:]:
        up = int(TREE_PARENT[j])
        while up >= 0 and not present[up]:
            up = int(TREE_PARENT[up])
        out[j] = up if up >= 0 else rows[0]
    return out
