"""Motion from pose to pose with the feet in one place: sitting down, fast arms, standing still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.synthesis.blocks import yaw_matrix
from pop_core.synthesis.pose_parts import arm_in_style, limbs_clear
from pop_core.synthesis.poses import ScenePose
from pop_core.synthesis.sequence_routes import Place, ease

ARM_STYLES = ('hang', 'hip', 'folded', 'forward', 'face', 'up', 'high', 'out')
FOOT_SOFT_M = 0.004  # which foot carries changes smoothly


@dataclass(frozen=True, slots=True)
class Tempo:
    """How poses follow each other.

    Args:
        move_s: Time from pose to pose.
        rest_s: Time in a pose.
    """

    move_s: float
    rest_s: float


class PoseToPose:
    """One person who goes through poses, over and over, each joint on the shortest turn."""

    def __init__(
        self, model: BodyModel, betas: Float[np.ndarray, 'b'], place: Place,
        poses: Sequence[ScenePose], tempo: Tempo,
    ) -> None:
        """Take a person, where the feet stand, and the poses."""
        self._model, self._betas, self._place, self._tempo = model, betas, place, tempo
        self._R = from_rotvec(np.array([np.vstack([p.tilt, p.body_pose]) for p in poses]))
        bone = model.weights.argmax(axis=1)
        self._feet = [
            np.flatnonzero(np.isin(bone, [
                JOINT_INDEX[f'{side}_ankle'], JOINT_INDEX[f'{side}_foot']]))
            for side in ('left', 'right')]

    def __call__(self, seconds: float) -> BodyParameters:
        """Return the body at a time, room frame."""
        number, since = divmod(seconds, self._tempo.move_s + self._tempo.rest_s)
        share = ease((since - self._tempo.rest_s) / self._tempo.move_s)
        start = self._R[int(number) % len(self._R)]
        end = self._R[(int(number) + 1) % len(self._R)]
        turned = to_rotvec(from_rotvec(share * to_rotvec(end @ start.swapaxes(1, 2))) @ start)
        R_room_heading = yaw_matrix(self._place.yaw_rad)
        body = BodyParameters(
            np.zeros(3), to_rotvec(R_room_heading @ from_rotvec(turned[0])), turned[1:],
            self._betas)
        return body.replaced(transl=self._place.p - self._standing_point(body))

    def _standing_point(self, body: BodyParameters) -> Float[np.ndarray, '3']:
        """Return the point between the ankles, at the height of the lower sole."""
        p = joints(self._model, body)
        soles = [vertices(self._model, body, foot)[:, 1].min() for foot in self._feet]
        level = -FOOT_SOFT_M * np.logaddexp.reduce(-np.array(soles) / FOOT_SOFT_M)
        middle = p[[JOINT_INDEX['left_ankle'], JOINT_INDEX['right_ankle']]].mean(axis=0)
        return np.array([middle[0], level, middle[2]])


def draw_arm_poses(
    model: BodyModel, base: ScenePose, count: int, rng: np.random.Generator
) -> list[ScenePose]:
    """Return poses that differ in their arms; on the way between two, limbs stay clear.

    Args:
        model: Body model.
        base: Everything but the arms.
        count: Number of poses.
        rng: Randomness.
    """
    poses = [base]
    while len(poses) < count:
        for _ in range(30):
            pose = base.body_pose
            for side in ('left', 'right'):
                style = str(rng.choice(ARM_STYLES))
                pose = arm_in_style(model, pose, side, style, rng)
            last = poses[0] if len(poses) == count - 1 else None
            if _clear_between(model, poses[-1].body_pose, pose) and (
                last is None or _clear_between(model, pose, last.body_pose)
            ):
                break
        poses.append(ScenePose('reaching', pose, base.tilt))
    return poses


def _clear_between(
    model: BodyModel, first: Float[np.ndarray, '23 3'], second: Float[np.ndarray, '23 3']
) -> bool:
    """Return whether limbs keep clear at the end and on three moments of the way."""
    start, end = from_rotvec(first), from_rotvec(second)
    turn = to_rotvec(end @ start.swapaxes(1, 2))
    return all(
        limbs_clear(model, to_rotvec(from_rotvec(share * turn) @ start))
        for share in (0.25, 0.5, 0.75, 1.0))
