"""Limbs rolled about their bones: knees that bend forward or sideways, elbows that bend backward.

Joint positions say nothing about how a bone is turned about its own axis, so a thigh can be fitted
back to front with the shin bent the wrong way, every joint in its place. Such a limb has another
reading with the same joint positions: the upper bone rolled until the hinge bends as hinges do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import LOWER, TWIST_AXES, UPPER, pose_coordinates
from pop_core.body.joints import JOINT_INDEX
from pop_core.fitting.roll_kernels import reading_costs
from pop_core.geometry.rotation import from_rotvec, to_rotvec

ROLLED_RAD = 0.35  # beyond its limits a limb is rolled; less is a limit that gave way
ROLLS_RAD = np.deg2rad(np.arange(-180.0, 180.0, 7.5))
EASE = 0.01  # weight of the coordinates themselves: of readings within limits, the easiest


@dataclass(frozen=True, slots=True)
class HingedLimb:
    """A limb of an upper and a lower bone: joints where they start, and where the lower ends."""

    upper: int
    hinge: int
    end: int

    def bones(
        self, joints: Float[np.ndarray, '24 3']
    ) -> tuple[Float[np.ndarray, '3'], Float[np.ndarray, '3']]:
        """Return the vectors along upper and lower bone [m]."""
        return joints[self.hinge] - joints[self.upper], joints[self.end] - joints[self.hinge]


LIMBS = tuple(
    HingedLimb(*(JOINT_INDEX[f'{side}_{name}'] for name in names))
    for names in (('hip', 'knee', 'ankle'), ('shoulder', 'elbow', 'wrist'))
    for side in ('left', 'right'))


def rolled_limbs(body_pose: Float[np.ndarray, '23 3']) -> list[HingedLimb]:
    """Return the limbs whose upper bone is turned, or whose hinge bends, as nobody's can."""
    c = pose_coordinates(body_pose)
    excess = np.maximum(c - UPPER, LOWER - c)
    rows = np.arange(len(excess))
    turned = excess[rows, TWIST_AXES] > ROLLED_RAD
    bent = (excess > ROLLED_RAD).any(axis=1)
    return [limb for limb in LIMBS if turned[limb.upper - 1] or bent[limb.hinge - 1]]


def unrolled(
    body_pose: Float[np.ndarray, '23 3'], rest_joints: Float[np.ndarray, '24 3']
) -> Float[np.ndarray, '23 3']:
    """Return a pose whose rolled limbs bend as limbs do, with hips to ankles where they were.

    Of all turns of the upper bone about its axis, undone at the hinge, and of the lower bone about
    its own, those that leave the least beyond the anatomical limits, and then the easiest. Hands
    and feet turn with their lower bone. A pose without rolled limbs is returned as it is.

    Args:
        body_pose: Rotation vectors [rad].
        rest_joints: Joints of the person in T-pose [m].
    """
    pose = body_pose.copy()
    for limb in rolled_limbs(body_pose):
        rows = [limb.upper - 1, limb.hinge - 1]
        pose[rows] = easiest_reading(limb, body_pose[rows], rest_joints)
    return pose


def easiest_reading(
    limb: HingedLimb, rotvecs: Float[np.ndarray, '2 3'], rest_joints: Float[np.ndarray, '24 3']
) -> Float[np.ndarray, '2 3']:
    """Return the rotations of upper bone and hinge [rad] that are easiest for the same joints."""
    bones = np.stack(limb.bones(rest_joints))
    bones /= np.linalg.norm(bones, axis=1, keepdims=True)
    rows = [limb.upper - 1, limb.hinge - 1]
    cost = reading_costs(
        rotvecs, bones, ROLLS_RAD, TWIST_AXES[rows], LOWER[rows], UPPER[rows], EASE)
    twist, roll = np.unravel_index(np.argmin(cost), cost.shape)
    R_upper, R_hinge = from_rotvec(rotvecs)
    R_roll, R_twist = from_rotvec(bones * ROLLS_RAD[[roll, twist], None])
    return to_rotvec(np.stack([R_upper @ R_roll, R_roll.T @ R_hinge @ R_twist]))
