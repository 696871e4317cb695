"""Angles and frames of REP-155's kinematic model of a human, from a fitted body.

The model's links have x forward and z up where a person stands with hanging arms; limbs run along
-z of their link. A waist that only pitches, shoulders and hips of three axes, elbows and knees of
one and a head of three carry the whole pose but for the torso's roll and yaw. Angles are chosen so
that every limb and the head point where the fitted ones do.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pop_core.body.joints import JOINT_INDEX

# Axes of a link in SMPL's frame of a joint: forward is z, left is x, up is y.
R_SMPL_LINK = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
SIDES = {'l': 'left', 'r': 'right'}
SIGN = {'l': 1, 'r': -1}  # the model's axes of the right side mirror those of the left
STRAIGHT_RAD = 0.05  # a limb bent less than this does not tell about which axis it bends
# Place [m] and orientation by link.
Frames = dict[str, tuple[Float[np.ndarray, '3'], Float[np.ndarray, '3 3']]]
# In the T-pose arms are spread; the model's hang.
HANGING = {side: Rotation.from_euler('x', sign * np.pi / 2).as_matrix()
           for side, sign in SIGN.items()}


def link_frames(
    joints: Float[np.ndarray, '24 3'], rotations: Float[np.ndarray, '24 3 3']
) -> Frames:
    """Return place [m] and orientation of REP-155's links in the frame of the joints.

    The body stands between the hips; 'torso' where the neck begins, with the chest's orientation.
    """
    at = {name: joints[row] for name, row in JOINT_INDEX.items()}
    turn = {name: rotations[row] @ R_SMPL_LINK for name, row in JOINT_INDEX.items()}
    frames = {
        'body': (0.5 * (at['left_hip'] + at['right_hip']), turn['pelvis']),
        'waist': (at['pelvis'], turn['spine1']), 'torso': (at['neck'], turn['spine3']),
        'head': (at['head'], turn['head'])}
    for side, word in SIDES.items():
        for link in ('shoulder', 'elbow', 'wrist'):
            name = f'{word}_{link}'
            frames[f'{side}_{link}'] = (at[name], turn[name] @ HANGING[side])
        for link in ('hip', 'knee', 'ankle'):
            name = f'{word}_{link}'
            frames[f'{side}_{link}'] = (at[name], turn[name])
    return frames


def joint_angles(
    joints: Float[np.ndarray, '24 3'], rotations: Float[np.ndarray, '24 3 3']
) -> dict[str, float]:
    """Return the angle [rad] of each joint of the model that is not fixed."""
    frames = link_frames(joints, rotations)
    R_body = frames['body'][1]
    waist = _pitch(R_body.T @ frames['torso'][1])
    R_torso = R_body @ Rotation.from_euler('y', waist).as_matrix()
    roll, yaw, pitch = _angles('XZY', R_torso.T @ frames['head'][1])
    found = {'waist': waist, 'r_head': roll, 'y_head': yaw, 'p_head': -pitch}
    for side, sign in SIGN.items():
        found |= _arm_angles(frames, side, sign, R_torso) | _leg_angles(frames, side, sign, R_body)
    return found


def _arm_angles(
    frames: Frames, side: str, sign: int, R_torso: Float[np.ndarray, '3 3']
) -> dict[str, float]:
    R_arm, elbow = _bent_limb(frames, side, ('shoulder', 'elbow', 'wrist'), 1)
    first, second, third = _angles('ZXZ', R_torso.T @ R_arm)
    if sign < 0:  # of the two solutions the one whose middle joint lifts the arm sideways
        first, second, third = _wrapped(first + np.pi), -second, _wrapped(third + np.pi)
    return {f'{side}_y_shoulder': -sign * first, f'{side}_p_shoulder': sign * second,
            f'{side}_r_shoulder': sign * third, f'{side}_elbow': elbow}


def _leg_angles(
    frames: Frames, side: str, sign: int, R_body: Float[np.ndarray, '3 3']
) -> dict[str, float]:
    R_leg, knee = _bent_limb(frames, side, ('hip', 'knee', 'ankle'), -1)
    yaw, spread, swing = _angles('ZXY', R_body.T @ R_leg)
    return {f'{side}_y_hip': -yaw, f'{side}_p_hip': sign * spread, f'{side}_r_hip': -swing,
            f'{side}_knee': knee}


def _bent_limb(
    frames: Frames, side: str, links: tuple[str, str, str], forward: int
) -> tuple[Float[np.ndarray, '3 3'], float]:
    """Return the upper link's orientation and the angle of the hinge below it.

    The hinge turns about -y: elbows (forward 1) bend to the front, knees (-1) to the back.
    """
    (top, R_upper), (middle, _), (end, _) = (
        frames[f'{side}_{link}'] for link in links)
    upper, lower = _unit(middle - top), _unit(end - middle)
    bend = float(np.arccos(np.clip(upper @ lower, -1, 1)))
    across = lower - (lower @ upper) * upper
    front = forward * across if bend > STRAIGHT_RAD else R_upper[:, 0]
    front = _unit(front - (front @ upper) * upper)
    return np.column_stack([front, np.cross(-upper, front), -upper]), forward * bend


def _pitch(R: Float[np.ndarray, '3 3']) -> float:
    """Return the turn about y that comes nearest to a rotation."""
    return float(np.arctan2(R[0, 2] - R[2, 0], R[0, 0] + R[2, 2]))


def _angles(axes: str, R: Float[np.ndarray, '3 3']) -> list[float]:
    return [float(angle) for angle in Rotation.from_matrix(R).as_euler(axes)]


def _wrapped(angle: float) -> float:
    return float(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def _unit(v: Float[np.ndarray, '3']) -> Float[np.ndarray, '3']:
    return v / np.linalg.norm(v)
