"""The 24 joints of the body tree and their correspondences with 2D keypoint sets."""

from __future__ import annotations

import numpy as np

JOINT_NAMES = (
    'pelvis', 'left_hip', 'right_hip', 'spine1', 'left_knee', 'right_knee', 'spine2',
    'left_ankle', 'right_ankle', 'spine3', 'left_foot', 'right_foot', 'neck', 'left_collar',
    'right_collar', 'head', 'left_shoulder', 'right_shoulder', 'left_elbow', 'right_elbow',
    'left_wrist', 'right_wrist', 'left_hand', 'right_hand',
)
PARENTS = (
    -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
)
N_JOINTS = len(JOINT_NAMES)
JOINT_INDEX = {name: index for index, name in enumerate(JOINT_NAMES)}


def mirrored_name(name: str) -> str:
    """Return the joint of the other side; joints on the midline are their own mirror."""
    if name.startswith('left_'):
        return 'right_' + name[5:]
    if name.startswith('right_'):
        return 'left_' + name[6:]
    return name


MIRROR = np.array([JOINT_INDEX[mirrored_name(name)] for name in JOINT_NAMES])

# The 15 joints shared by SMPL and OpenPose BODY_25 (Figure 2 of the paper), in this order
# everywhere; the head is seen as OpenPose's nose.
SHARED_NAMES = (
    'pelvis', 'left_hip', 'right_hip', 'left_knee', 'right_knee', 'left_ankle', 'right_ankle',
    'neck', 'head', 'left_shoulder', 'right_shoulder', 'left_elbow', 'right_elbow',
    'left_wrist', 'right_wrist',
)
SHARED = np.array([JOINT_INDEX[name] for name in SHARED_NAMES])
SHARED_INDEX = {name: index for index, name in enumerate(SHARED_NAMES)}
SHARED_MIRROR = np.array([SHARED_INDEX[mirrored_name(name)] for name in SHARED_NAMES])
N_SHARED = len(SHARED_NAMES)

# Row of each shared joint in OpenPose's BODY_25 output.
BODY_25_OF_SHARED = np.array([8, 12, 9, 13, 10, 14, 11, 1, 0, 5, 2, 6, 3, 7, 4])

COCO_17_NAMES = (
    'nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear', 'left_shoulder', 'right_shoulder',
    'left_elbow', 'right_elbow', 'left_wrist', 'right_wrist', 'left_hip', 'right_hip',
    'left_knee', 'right_knee', 'left_ankle', 'right_ankle',
)
