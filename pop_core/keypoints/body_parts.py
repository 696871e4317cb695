"""The 15 body parts that the depth network tells apart: the 24 joints, small ones joined."""

from __future__ import annotations

import numpy as np

from pop_core.body.joints import JOINT_INDEX, JOINT_NAMES, MIRROR, mirrored_name

# Named by the joint that stands for the part in label images.
PART_NAMES = (
    'pelvis', 'spine3', 'head', 'left_shoulder', 'right_shoulder', 'left_elbow', 'right_elbow',
    'left_wrist', 'right_wrist', 'left_hip', 'right_hip', 'left_knee', 'right_knee',
    'left_ankle', 'right_ankle',
)
_JOINED = {
    'spine1': 'pelvis', 'spine2': 'spine3', 'left_collar': 'spine3', 'right_collar': 'spine3',
    'neck': 'head', 'left_hand': 'left_wrist', 'right_hand': 'right_wrist',
    'left_foot': 'left_ankle', 'right_foot': 'right_ankle',
}
BACKGROUND = 0
N_CLASSES = 1 + len(PART_NAMES)
# Class of each joint, the last entry for label -1; and the label that stands for each class.
CLASS_OF_LABEL = np.array(
    [1 + PART_NAMES.index(_JOINED.get(name, name)) for name in JOINT_NAMES] + [BACKGROUND])
LABEL_OF_CLASS = np.array([-1, *(JOINT_INDEX[name] for name in PART_NAMES)], dtype=np.int8)
# Label of the other side, the last entry for label -1.
LABEL_MIRROR = np.array([*MIRROR, -1], dtype=np.int8)
CLASS_MIRROR = np.array(
    [BACKGROUND, *(1 + PART_NAMES.index(mirrored_name(name)) for name in PART_NAMES)])
