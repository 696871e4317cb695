"""A batch of figures being posed: trunk, then legs, then arms, in the upright frame.

Upright frame: y up, the heading +z, the person's left +x, origin at the pelvis [m, rad].
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import LOWER, TWIST_AXES, UPPER, pose_coordinates
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.geometry.swing_twist import from_swing_twist
from pop_core.retrieval.canonical_pose import SPINE, SPINE_SHARES
from pop_core.retrieval.procedural.limbs import (
    arm_rotation,
    leg_rotation,
    two_bone_directions,
)

SIDES = {'left': 1.0, 'right': -1.0}


class Figures:
    """Many poses under construction."""

    def __init__(self, n: int, model: BodyModel) -> None:
        """Start n figures in T-pose with the proportions of a model's mean body."""
        self.n = n
        self.rest = model.joint_template - model.joint_template[0]
        self.pose = np.zeros((n, 23, 3))
        self.tilt = np.zeros((n, 3))
        self.reached = np.ones(n, dtype=bool)  # whether limits left limbs where they were put

    def turn_joint(self, name: str, rotvec: Float[np.ndarray, 'n 3']) -> None:
        """Set one joint's rotation vector [rad]."""
        self.pose[:, JOINT_INDEX[name] - 1] = rotvec

    def bend_spine(self, rotvec: Float[np.ndarray, 'n 3']) -> None:
        """Share a turn of the chest relative to the pelvis among the spine's joints."""
        for name, share in zip(SPINE, SPINE_SHARES, strict=True):
            self.turn_joint(name, share * rotvec)

    def turn_head(self, rotvec: Float[np.ndarray, 'n 3']) -> None:
        """Share a turn of the head relative to the chest between neck and head."""
        self.turn_joint('neck', 0.5 * rotvec)
        self.turn_joint('head', 0.5 * rotvec)

    def length(self, name: str, parent: str) -> float:
        """Return the length of the bone between two joints [m]."""
        bone = self.rest[JOINT_INDEX[name]] - self.rest[JOINT_INDEX[parent]]
        return float(np.linalg.norm(bone))

    def chest(self) -> tuple[Float[np.ndarray, 'n 3 3'], Float[np.ndarray, 'n 3']]:
        """Return the chest's rotation and the place of spine3 in the upright frame."""
        R = from_rotvec(self.tilt)
        place, last = np.zeros((self.n, 3)), 0
        for name in SPINE:
            index = JOINT_INDEX[name]
            place = place + R @ (self.rest[index] - self.rest[last])
            R, last = R @ from_rotvec(self.pose[:, index - 1]), index
        return R, place

    def hip(self, side: str) -> Float[np.ndarray, 'n 3']:
        """Return the hip's place in the upright frame [m]."""
        return np.asarray(from_rotvec(self.tilt) @ self.rest[JOINT_INDEX[f'{side}_hip']])

    def knee(self, side: str) -> Float[np.ndarray, 'n 3']:
        """Return the knee's place in the upright frame [m]."""
        R = from_rotvec(self.tilt) @ from_rotvec(self.pose[:, JOINT_INDEX[f'{side}_hip'] - 1])
        bone = self.rest[JOINT_INDEX[f'{side}_knee']] - self.rest[JOINT_INDEX[f'{side}_hip']]
        return np.asarray(self.hip(side) + R @ bone)

    def set_leg(
        self, side: str, thigh: Float[np.ndarray, 'n 3'], shin: Float[np.ndarray, 'n 3'],
        knee_pole: Float[np.ndarray, 'n 3'],
    ) -> None:
        """Point thigh and shin along unit directions of the upright frame."""
        R, knee = leg_rotation(thigh, shin, knee_pole)
        R_pelvis = from_rotvec(self.tilt)
        self.turn_joint(f'{side}_hip', to_rotvec(R_pelvis.transpose(0, 2, 1) @ R))
        self.turn_joint(f'{side}_knee', knee)
        self._limit((f'{side}_hip', f'{side}_knee'))

    def reach_leg(
        self, side: str, ankle: Float[np.ndarray, 'n 3'], knee_pole: Float[np.ndarray, 'n 3']
    ) -> None:
        """Put an ankle at a place of the upright frame [m], the knee towards the pole."""
        lengths = (
            self.length(f'{side}_knee', f'{side}_hip'),
            self.length(f'{side}_ankle', f'{side}_knee'))
        u, v = two_bone_directions(ankle - self.hip(side), lengths, knee_pole)
        self.set_leg(side, u, v, knee_pole)

    def aim_foot(self, side: str, rotvec: Float[np.ndarray, 'n 3']) -> None:
        """Turn a foot to an orientation in the upright frame, as far as the ankle allows."""
        R = from_rotvec(self.tilt)
        for name in ('hip', 'knee'):
            R = R @ from_rotvec(self.pose[:, JOINT_INDEX[f'{side}_{name}'] - 1])
        wanted = R.transpose(0, 2, 1) @ from_rotvec(rotvec)
        self.turn_joint(f'{side}_ankle', to_rotvec(wanted))

    def shoulder(self, side: str) -> Float[np.ndarray, 'n 3']:
        """Return the shoulder's place in the chest's frame [m], collar included."""
        collar, shoulder = JOINT_INDEX[f'{side}_collar'], JOINT_INDEX[f'{side}_shoulder']
        root = self.rest[collar] - self.rest[JOINT_INDEX['spine3']]
        bone = self.rest[shoulder] - self.rest[collar]
        return np.asarray(root + from_rotvec(self.pose[:, collar - 1]) @ bone)

    def set_arm(
        self, side: str, upper: Float[np.ndarray, 'n 3'], forearm: Float[np.ndarray, 'n 3'],
        elbow_pole: Float[np.ndarray, 'n 3'],
    ) -> None:
        """Point upper arm and forearm along unit directions of the chest's frame."""
        R, elbow = arm_rotation(upper, forearm, elbow_pole, SIDES[side])
        R_collar = from_rotvec(self.pose[:, JOINT_INDEX[f'{side}_collar'] - 1])
        self.turn_joint(f'{side}_shoulder', to_rotvec(R_collar.transpose(0, 2, 1) @ R))
        self.turn_joint(f'{side}_elbow', elbow)
        self._limit((f'{side}_shoulder', f'{side}_elbow'))

    def reach_arm(
        self, side: str, wrist: Float[np.ndarray, 'n 3'], elbow_pole: Float[np.ndarray, 'n 3']
    ) -> None:
        """Put a wrist at a place of the chest's frame [m], the elbow towards the pole."""
        lengths = (
            self.length(f'{side}_elbow', f'{side}_shoulder'),
            self.length(f'{side}_wrist', f'{side}_elbow'))
        u, v = two_bone_directions(wrist - self.shoulder(side), lengths, elbow_pole)
        self.set_arm(side, u, v, elbow_pole)

    def in_chest(self, places: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n 3']:
        """Return places of the upright frame [m] in the chest's frame."""
        R, origin = self.chest()
        return np.einsum('nrc,nr->nc', R, places - origin)

    def limited(self) -> Float[np.ndarray, 'n 23 3']:
        """Return the poses with every joint within its limits."""
        return from_swing_twist(np.clip(pose_coordinates(self.pose), LOWER, UPPER), TWIST_AXES)

    def _limit(self, names: tuple[str, ...], slack_rad: float = 0.15) -> None:
        """Note the figures whose limb the limits would move away from where it was put."""
        rows = [JOINT_INDEX[name] - 1 for name in names]
        c = pose_coordinates(self.pose)[:, rows]
        excess = np.maximum(c - UPPER[rows], LOWER[rows] - c).max(axis=(1, 2))
        self.reached &= excess < slack_rad
