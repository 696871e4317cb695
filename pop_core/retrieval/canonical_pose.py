"""One pose for one posture: where motion data use different rotations, choose the anatomical one.

Captured motion that was retargeted from other skeletons carries its limbs to the right places with
rotations no body makes: elbows that bend about any axis (the upper arm's turn is free to make up
for it), and the whole bend of the spine in one vertebra. Limits and priors need one convention.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from pop_core.body.joint_limits import LOWER, TWIST_AXES, UPPER, pose_coordinates
from pop_core.body.joints import JOINT_INDEX
from pop_core.geometry.swing_twist import from_swing_twist

# Below the first angle an elbow is straight and its axis means nothing; above the second it is
# trusted [rad].
STRAIGHT_RAD, BENT_RAD = 0.1, 0.35
SPINE = ('spine1', 'spine2', 'spine3')
SPINE_SHARES = (0.45, 0.3, 0.25)


def canonical_pose(body_pose: Float[np.ndarray, 'n 23 3']) -> Float[np.ndarray, 'n 23 3']:
    """Return poses with hinged elbows, an evenly bent spine, and all joints within their limits.

    Elbows, wrists, knees and ankles keep their places relative to the chest and the pelvis.
    """
    pose = spread_spine(hinge_elbows(body_pose))
    return from_swing_twist(np.clip(pose_coordinates(pose), LOWER, UPPER), TWIST_AXES)


def hinge_elbows(body_pose: Float[np.ndarray, 'n 23 3']) -> Float[np.ndarray, 'n 23 3']:
    """Turn each upper arm about itself until its elbow bends about the hinge, the y axis."""
    pose = np.array(body_pose, dtype=np.float64)
    swing = pose_coordinates(pose)
    for side, sign in (('left', -1.0), ('right', 1.0)):
        shoulder, elbow = JOINT_INDEX[f'{side}_shoulder'] - 1, JOINT_INDEX[f'{side}_elbow'] - 1
        y, z = swing[:, elbow, 1], swing[:, elbow, 2]
        trust = np.clip((np.hypot(y, z) - STRAIGHT_RAD) / (BENT_RAD - STRAIGHT_RAD), 0.0, 1.0)
        turn = np.zeros((len(pose), 3))
        turn[:, 0] = trust * np.arctan2(sign * z, sign * y)
        roll = Rotation.from_rotvec(turn)
        pose[:, shoulder] = (Rotation.from_rotvec(pose[:, shoulder]) * roll).as_rotvec()
        pose[:, elbow] = (roll.inv() * Rotation.from_rotvec(pose[:, elbow])).as_rotvec()
    return pose


def spread_spine(body_pose: Float[np.ndarray, 'n 23 3']) -> Float[np.ndarray, 'n 23 3']:
    """Share the total turn of the spine among its three joints; the chest keeps its direction."""
    pose = np.array(body_pose, dtype=np.float64)
    first, second, third = (JOINT_INDEX[name] - 1 for name in SPINE)
    total = (
        Rotation.from_rotvec(pose[:, first]) * Rotation.from_rotvec(pose[:, second])
        * Rotation.from_rotvec(pose[:, third])
    ).as_rotvec()
    for joint, share in zip((first, second, third), SPINE_SHARES, strict=True):
        pose[:, joint] = share * total
    return pose
