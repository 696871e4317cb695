"""Legs that put given feet onto the floor: inverse kinematics of hip, knee and ankle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import tpose_vertices
from pop_core.geometry.rotation import to_rotvec
from pop_core.synthesis.blocks import yaw_matrix
from pop_core.synthesis.two_bones import MAX_STRETCH, bend, bone_frame

SIDES = ('left', 'right')
SOFT_M = 0.01  # the pelvis passes smoothly to the reach of a leg


@dataclass(frozen=True, slots=True, eq=False)
class Feet:
    """Where both feet are, left first, room frame.

    Args:
        soles: Points of the floor plane below the ankles, lifted while a foot swings [m].
        yaw_rad: Heading of each foot.
        heel_rad: How far each heel is raised, the foot turning about its ball.
    """

    soles: Float[np.ndarray, '2 3']
    yaw_rad: Float[np.ndarray, '2']
    heel_rad: Float[np.ndarray, '2']


class Legs:
    """The legs of one person: lengths and soles, measured once."""

    def __init__(self, model: BodyModel, betas: Float[np.ndarray, 'b']) -> None:
        """Measure the T-pose."""
        shaped = BodyParameters(np.zeros(3), np.zeros(3), np.zeros((23, 3)), betas)
        self._model = model
        self._rest = pose_skeleton(model, shaped).rest_joints
        bone = model.weights.argmax(axis=1)
        feet = np.isin(bone, [JOINT_INDEX[f'{side}_foot'] for side in SIDES])
        floor_m = float(tpose_vertices(model, shaped)[feet, 1].min())
        self.ankle_m = float(self._rest[JOINT_INDEX['left_ankle'], 1]) - floor_m

    def planted(
        self, standing: BodyParameters, feet: Feet, stoop_m: float = 0.0
    ) -> BodyParameters:
        """Return a body on its feet: legs bent, pelvis where both legs reach the floor.

        Args:
            standing: Body whose pelvis stands right horizontally and in orientation.
            feet: Where its feet are.
            stoop_m: How much lower than on straight legs the pelvis would be.
        """
        ankles = self._ankles(feet)
        skeleton = pose_skeleton(self._model, standing)
        lift_m = self._lift_m(skeleton.p + standing.transl, ankles, stoop_m)
        placed = standing.replaced(transl=standing.transl + np.array([0.0, lift_m, 0.0]))
        pose = standing.body_pose.copy()
        for k, side in enumerate(SIDES):
            hip, knee, ankle = (JOINT_INDEX[f'{side}_{n}'] for n in ('hip', 'knee', 'ankle'))
            R_room_foot = self._foot(feet, k)
            R_room_thigh, R_room_shin = self._leg(
                side, ankles[k] - skeleton.p[hip] - placed.transl, skeleton.G[0])
            pose[hip - 1] = to_rotvec(skeleton.G[0].T @ R_room_thigh)
            pose[knee - 1] = to_rotvec(R_room_thigh.T @ R_room_shin)
            pose[ankle - 1] = to_rotvec(R_room_shin.T @ R_room_foot)
        return placed.replaced(body_pose=pose)

    def _foot(self, feet: Feet, k: int) -> Float[np.ndarray, '3 3']:
        c, s = np.cos(feet.heel_rad[k]), np.sin(feet.heel_rad[k])
        raised = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        return yaw_matrix(float(feet.yaw_rad[k])) @ raised

    def _ankles(self, feet: Feet) -> Float[np.ndarray, '2 3']:
        """Return ankles: above their soles, further up and ahead when the heel is raised."""
        out = np.empty((2, 3))
        for k, side in enumerate(SIDES):
            arm = self._rest[JOINT_INDEX[f'{side}_ankle']] - self._rest[
                JOINT_INDEX[f'{side}_foot']]
            turned = (self._foot(feet, k) - yaw_matrix(float(feet.yaw_rad[k]))) @ arm
            out[k] = feet.soles[k] + np.array([0.0, self.ankle_m, 0.0]) + turned
        return out

    def _lift_m(
        self, p: Float[np.ndarray, '24 3'], ankles: Float[np.ndarray, '2 3'], stoop_m: float
    ) -> float:
        """Return how far the pelvis rises: as wanted, or until a leg is stretched (softly)."""
        hips = p[[JOINT_INDEX['left_hip'], JOINT_INDEX['right_hip']], 1]
        straight = MAX_STRETCH * sum(self._lengths('left')) + self.ankle_m
        highest = [straight - float(hips.mean()) - stoop_m]
        for k, side in enumerate(SIDES):
            hip = p[JOINT_INDEX[f'{side}_hip']]
            apart2 = float(((hip - ankles[k])[[0, 2]] ** 2).sum())
            length = MAX_STRETCH * sum(self._lengths(side))
            highest.append(float(ankles[k, 1]) + np.sqrt(max(length**2 - apart2, 0.01)) - hip[1])
        return float(-SOFT_M * np.logaddexp.reduce(-np.array(highest) / SOFT_M))

    def _lengths(self, side: str) -> tuple[float, float]:
        hip, knee, ankle = (self._rest[JOINT_INDEX[f'{side}_{n}']]
                            for n in ('hip', 'knee', 'ankle'))
        return float(np.linalg.norm(knee - hip)), float(np.linalg.norm(ankle - knee))

    def _leg(
        self, side: str, to_ankle: Float[np.ndarray, '3'], R_room_pelvis: Float[np.ndarray, '3 3']
    ) -> tuple[Float[np.ndarray, '3 3'], Float[np.ndarray, '3 3']]:
        """Return orientations of thigh and shin, knee ahead."""
        hip, knee, ankle = (self._rest[JOINT_INDEX[f'{side}_{n}']]
                            for n in ('hip', 'knee', 'ankle'))
        upper, lower = bend(
            to_ankle, R_room_pelvis @ np.array([0.0, 0.0, 1.0]), *self._lengths(side))
        hinge, rest_hinge = np.cross(upper, lower), np.array([1.0, 0.0, 0.0])
        return (bone_frame(upper, hinge) @ bone_frame(knee - hip, rest_hinge).T,
                bone_frame(lower, hinge) @ bone_frame(ankle - knee, rest_hinge).T)
