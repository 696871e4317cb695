"""From the keypoint sets of the field to the 15 shared joints; the one place that knows them.

Orders: COCO-17 of the dataset's person_keypoints annotations, COCO-WholeBody-133 and Halpe-26 of
theirs, MPII-16 of its annotations, BODY_25 and COCO-18 of OpenPose's poseParameters.cpp.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import BODY_25_OF_SHARED, COCO_17_NAMES, N_SHARED, SHARED_NAMES
from pop_core.errors import DetectionError
from pop_core.keypoints.neck import with_smpl_neck

# Where a set marks neither: midway between hips and between shoulders.
MIDWAY = {'pelvis': ('left_hip', 'right_hip'), 'neck': ('left_shoulder', 'right_shoulder')}


@dataclass(frozen=True, slots=True)
class KeypointSet:
    """Keypoints in the order of a network's output.

    Args:
        name: The set's usual name.
        names: Name of each keypoint, as the shared joints are named where they are the same; the
            shared head is the nose, the neck any point between the shoulders.
    """

    name: str
    names: tuple[str, ...]

    def __len__(self) -> int:
        """Return the number of keypoints."""
        return len(self.names)


def shared_joints(
    keypoints: KeypointSet,
    keypoints_px: Float[np.ndarray, 'k 2'],
    scores: Float[np.ndarray, 'k'],
) -> tuple[Float[np.ndarray, 's 2'], Float[np.ndarray, 's']]:
    """Return pixels and scores of the 15 shared joints; a midpoint is as sure as its worse end.

    Keypoints that are no numbers, or whose score is not above 0, count as undetected; scores
    above 1 are cut.

    Args:
        keypoints: The set whose keypoints are given.
        keypoints_px: Pixels (u, v).
        scores: Confidence 0..1 of each.

    Raises:
        DetectionError: If there are more or fewer than the set has.
    """
    expected = (len(keypoints), 2), (len(keypoints),)
    found = np.shape(keypoints_px), np.shape(scores)
    if found != expected:
        raise DetectionError(
            f'{keypoints.name}: expected pixels and scores of shapes {expected[0]} and '
            f'{expected[1]}, found {found[0]} and {found[1]}')
    row = {name: index for index, name in enumerate(keypoints.names)}
    finite = np.isfinite(keypoints_px).all(axis=1) & np.isfinite(scores)
    known = np.where(finite, np.clip(np.nan_to_num(scores), 0.0, 1.0), 0.0)
    shared_px, shared_scores = np.full((N_SHARED, 2), np.nan), np.zeros(N_SHARED)
    for j, joint in enumerate(SHARED_NAMES):
        name = 'nose' if joint == 'head' else joint
        first, second = (name, name) if name in row else MIDWAY.get(name, ('', ''))
        if first not in row or second not in row:
            continue
        a, b = row[first], row[second]
        if min(known[a], known[b]) > 0:
            shared_px[j] = 0.5 * (keypoints_px[a] + keypoints_px[b])
            shared_scores[j] = min(known[a], known[b])
    return with_smpl_neck(shared_px), shared_scores


def _body_25() -> tuple[str, ...]:
    names = [f'other_{row}' for row in range(25)]
    for joint, row in zip(SHARED_NAMES, BODY_25_OF_SHARED, strict=True):
        names[row] = 'nose' if joint == 'head' else joint
    return tuple(names)


COCO_17 = KeypointSet('COCO-17', COCO_17_NAMES)
BODY_25 = KeypointSet('BODY_25', _body_25())
COCO_18 = KeypointSet('COCO-18', (  # OpenPose's first set: BODY_25 without hip centre and feet
    'nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder',
    'left_elbow', 'left_wrist', 'right_hip', 'right_knee', 'right_ankle', 'left_hip', 'left_knee',
    'left_ankle', 'right_eye', 'left_eye', 'right_ear', 'left_ear',
))
MPII_16 = KeypointSet('MPII-16', (  # no nose; its thorax lies between the shoulders
    'head_top', 'upper_neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'neck',
    'left_shoulder', 'left_elbow', 'left_wrist', 'pelvis', 'right_hip', 'right_knee',
    'right_ankle', 'left_hip', 'left_knee', 'left_ankle',
))
HALPE_26 = KeypointSet('Halpe-26', (
    *COCO_17_NAMES, 'head_top', 'neck', 'pelvis', 'left_big_toe', 'right_big_toe',
    'left_small_toe', 'right_small_toe', 'left_heel', 'right_heel',
))
# COCO's 17, then feet, face and hands, none of which is a shared joint.
WHOLEBODY_133 = KeypointSet('COCO-WholeBody-133', (
    *COCO_17_NAMES, *(f'other_{row}' for row in range(17, 133))))
BY_COUNT = {len(keypoints): keypoints for keypoints in (COCO_17, HALPE_26, WHOLEBODY_133)}
# Of OpenPose, and of what writes its files for other networks.
OF_FILES = BY_COUNT | {len(keypoints): keypoints for keypoints in (COCO_18, BODY_25)}
