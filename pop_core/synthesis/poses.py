"""Poses of people in scenes: standing, walking, seated, lying, reaching, bending, crouching.

Rotation vectors are SMPL's: flexing a hip or bending an elbow is told by the axis that does it in
the T-pose (y up, facing +z, the person's left is +x).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import (
    LOWER,
    TWIST_AXES,
    UPPER,
    mirrored_pose,
    pose_coordinates,
)
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.geometry.swing_twist import from_swing_twist
from pop_core.retrieval.pose_prior import PosePrior, load_pose_prior
from pop_core.synthesis.pose_parts import (
    arm_in_style,
    bend_spine,
    flex,
    jittered,
    limbs_clear,
    look_around,
    set_joint,
    standing_base,
)

POSE_KINDS = ('standing', 'walking', 'seated', 'lying', 'reaching', 'bending', 'crouching',
              'motion')
MAX_TILT_RAD = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class ScenePose:
    """A pose and how its pelvis is turned before the person is placed.

    Args:
        kind: One of POSE_KINDS.
        body_pose: Rotation vectors of joints 1..23 [rad].
        tilt: Rotation vector of the pelvis in a frame with y up whose +z is the heading [rad].
    """

    kind: str
    body_pose: Float[np.ndarray, '23 3']
    tilt: Float[np.ndarray, '3']


def draw_pose(model: BodyModel, kind: str, rng: np.random.Generator) -> ScenePose:
    """Return a random pose of a kind whose limbs keep clear of torso and each other."""
    for _ in range(30):
        pose = _DRAWS[kind](model, rng)
        pose = ScenePose(kind, jittered(pose.body_pose, rng), pose.tilt)
        if rng.random() < 0.5:
            pose = mirrored(pose)
        if limbs_clear(model, pose.body_pose):
            return pose
    return pose


def mirrored(pose: ScenePose) -> ScenePose:
    """Return the pose of the mirror image, left for right."""
    tilt = pose.tilt * np.array([1.0, -1.0, -1.0])
    return ScenePose(pose.kind, mirrored_pose(pose.body_pose), tilt)


def balancing_tilt(
    model: BodyModel, body_pose: Float[np.ndarray, '23 3']
) -> Float[np.ndarray, '3']:
    """Return the turn of the pelvis [rad] that brings the trunk above the lower foot.

    Mocap statistics are kept without the pelvis; who stands, stands over the feet.
    """
    p = joints(model, BodyParameters(
        np.zeros(3), np.zeros(3), body_pose, np.zeros(model.n_betas)))
    feet = p[[JOINT_INDEX['left_ankle'], JOINT_INDEX['right_ankle']]]
    share = 1.0 / (1.0 + np.exp(-20.0 * (feet[1, 1] - feet[0, 1])))  # of the left foot
    lean = p[[0, JOINT_INDEX['spine3']]].mean(axis=0) - share * feet[0] - (1 - share) * feet[1]
    lean = lean / np.linalg.norm(lean)
    axis = np.cross(lean, [0.0, 1.0, 0.0])
    sine = float(np.linalg.norm(axis))
    angle = min(float(np.arctan2(sine, lean[1])), MAX_TILT_RAD)
    return axis / max(sine, 1e-9) * angle


def walking_pose(
    model: BodyModel, phase_rad: float, stride: float = 1.0, arms: float = 1.0
) -> Float[np.ndarray, '23 3']:
    """Return a moment of a walk; `phase_rad` runs through 2 pi per pair of steps."""
    pose = standing_base(model, np.array([0.06, -0.03]))
    for side, phase in (('left', phase_rad), ('right', phase_rad + np.pi)):
        swing = np.sin(phase)
        lifted = np.clip(np.cos(phase), 0.0, 1.0)  # the leg moves forward while its sine grows
        flex(pose, f'{side}_hip', np.deg2rad(stride * (26 * swing + 14 * lifted)))
        flex(pose, f'{side}_knee', -np.deg2rad(6 + stride * (48 * lifted + 6 * max(0.0, -swing))))
        flex(pose, f'{side}_ankle', np.deg2rad(stride * (8 * lifted - 10 * max(0.0, -swing))))
    swing_arms(pose, phase_rad, arms)
    set_joint(pose, 'spine2', [0.0, np.deg2rad(5) * np.sin(phase_rad), 0.0])
    return pose


def swing_arms(pose: Float[np.ndarray, '23 3'], phase_rad: float, arms: float) -> None:
    """Swing hanging arms as in a walk, each with the leg of the other side, in place."""
    for side, phase, sign in (('left', phase_rad + np.pi, 1.0), ('right', phase_rad, -1.0)):
        arm = np.deg2rad(arms * 24 * np.sin(phase))
        index = JOINT_INDEX[f'{side}_shoulder'] - 1
        forward = from_rotvec(np.array([-arm, 0.0, 0.0]))
        pose[index] = to_rotvec(forward @ from_rotvec(pose[index]))
        pose[JOINT_INDEX[f'{side}_elbow'] - 1] = [0.0, -sign * (0.25 + 0.3 * max(0.0, arm)), 0.0]


def _draw_standing(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = standing_base(model, rng.uniform([0.0, -0.06], [0.16, 0.06]))
    flex(pose, 'left_hip', rng.uniform(-0.1, 0.25))
    flex(pose, 'left_knee', -rng.uniform(0.0, 0.35))
    look_around(pose, rng)
    for side in ('left', 'right'):
        style = rng.choice(_STANDING_ARMS, p=_STANDING_ARM_SHARES)
        pose = arm_in_style(model, pose, side, style, rng)
    return ScenePose('standing', pose, np.zeros(3))


def _draw_walking(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = walking_pose(model, rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 1.3),
                        rng.uniform(0.3, 1.4))
    look_around(pose, rng)
    if rng.random() < 0.3:
        pose = arm_in_style(model, pose, 'left', rng.choice(_STANDING_ARMS), rng)
    return ScenePose('walking', pose, np.array([rng.uniform(-0.02, 0.12), 0.0, 0.0]))


def _draw_seated(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    lean = rng.uniform(-0.25, 0.3)
    pose = standing_base(model, rng.uniform([0.02, -0.05], [0.3, 0.05]))
    for side in ('left', 'right'):
        flex(pose, f'{side}_hip', np.deg2rad(rng.uniform(78, 95)) + lean * 0.5)
        flex(pose, f'{side}_knee', -np.deg2rad(rng.uniform(65, 100)))
    bend_spine(pose, rng.uniform(0.0, 0.5))
    look_around(pose, rng)
    style = str(rng.choice(
        ['thigh', 'forward', 'folded', 'face', 'hang'], p=[0.45, 0.2, 0.15, 0.1, 0.1]))
    for side in ('left', 'right'):
        if rng.random() < 0.25:
            style = _one_of(rng, 'thigh', 'forward', 'face')
        pose = arm_in_style(model, pose, side, style, rng)
    return ScenePose('seated', pose, np.array([lean, 0.0, 0.0]))


def _draw_lying(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = standing_base(model, rng.uniform([0.0, -0.05], [0.25, 0.05]))
    bend = rng.uniform(0.0, 1.0) if rng.random() < 0.5 else 0.1
    for side in ('left', 'right'):
        share = rng.uniform(0.7, 1.0)
        flex(pose, f'{side}_hip', bend * share)
        flex(pose, f'{side}_knee', -bend * share * 1.7)
    look_around(pose, rng)
    for side in ('left', 'right'):
        pose = arm_in_style(model, pose, side, _one_of(rng, 'hang', 'folded', 'out'), rng)
    on_back = from_rotvec(np.array([-np.pi / 2, 0.0, 0.0]))
    roll = rng.choice([0.0, np.pi / 2, -np.pi / 2], p=[0.5, 0.25, 0.25]) + rng.normal(0, 0.15)
    return ScenePose('lying', pose, to_rotvec(on_back @ from_rotvec(np.array([0.0, roll, 0.0]))))


def _draw_reaching(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = standing_base(model, rng.uniform([0.02, -0.05], [0.2, 0.05]))
    bend_spine(pose, rng.uniform(-0.1, 0.4))
    flex(pose, 'left_hip', rng.uniform(0.0, 0.4))
    flex(pose, 'left_knee', -rng.uniform(0.0, 0.4))
    look_around(pose, rng)
    pose = arm_in_style(model, pose, 'left', _one_of(rng, 'forward', 'up', 'out', 'high'), rng)
    pose = arm_in_style(model, pose, 'right', _one_of(rng, 'hang', 'forward', 'up', 'hip'), rng)
    return ScenePose('reaching', pose, np.array([rng.uniform(-0.05, 0.15), 0.0, 0.0]))


def _draw_motion(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    drawn = _motion_prior().sample(rng, 1)[0]
    pose = from_swing_twist(np.clip(pose_coordinates(drawn), LOWER, UPPER), TWIST_AXES)
    return ScenePose('motion', pose, balancing_tilt(model, pose))


@cache
def _motion_prior() -> PosePrior:
    return load_pose_prior().motion_part()


def _draw_bending(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = standing_base(model, rng.uniform([0.02, -0.05], [0.2, 0.05]))
    tilt = rng.uniform(0.3, 1.0)
    for side in ('left', 'right'):
        knee = rng.uniform(0.1, 0.6)
        flex(pose, f'{side}_hip', tilt + 0.5 * knee)
        flex(pose, f'{side}_knee', -knee)
    bend_spine(pose, rng.uniform(0.2, 0.9))
    for side in ('left', 'right'):
        pose = arm_in_style(model, pose, side, _one_of(rng, 'forward', 'down', 'thigh'), rng)
    return ScenePose('bending', pose, np.array([tilt, 0.0, 0.0]))


def _draw_crouching(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = standing_base(model, rng.uniform([0.1, -0.05], [0.4, 0.05]))
    tilt = rng.uniform(0.1, 0.5)
    for side in ('left', 'right'):
        knee = np.deg2rad(rng.uniform(95, 135))
        flex(pose, f'{side}_hip', knee * 0.62 + tilt + rng.uniform(0.1, 0.3))
        flex(pose, f'{side}_knee', -knee)
        flex(pose, f'{side}_ankle', 0.3)
    bend_spine(pose, rng.uniform(0.1, 0.6))
    look_around(pose, rng)
    for side in ('left', 'right'):
        pose = arm_in_style(model, pose, side, _one_of(rng, 'forward', 'thigh', 'face'), rng)
    return ScenePose('crouching', pose, np.array([tilt, 0.0, 0.0]))


_DRAWS: dict[str, Callable[[BodyModel, np.random.Generator], ScenePose]] = {
    'standing': _draw_standing, 'walking': _draw_walking, 'seated': _draw_seated,
    'lying': _draw_lying, 'reaching': _draw_reaching, 'bending': _draw_bending,
    'crouching': _draw_crouching, 'motion': _draw_motion,
}
_STANDING_ARMS = ['hang', 'hip', 'folded', 'forward', 'face', 'up', 'out']
_STANDING_ARM_SHARES = [0.42, 0.12, 0.12, 0.14, 0.1, 0.05, 0.05]


def _one_of(rng: np.random.Generator, *names: str) -> str:
    return names[int(rng.integers(len(names)))]
