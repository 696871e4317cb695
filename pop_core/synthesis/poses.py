"""Poses of people in scenes: standing, walking, seated, lying, reaching, bending, crouching.

Rotation vectors are SMPL's: flexing a hip or bending an elbow is told by the axis that does it in
the T-pose (y up, facing +z, the person's left is +x).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX, MIRROR
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.synthesis.arms import reach

POSE_KINDS = ('standing', 'walking', 'seated', 'lying', 'reaching', 'bending', 'crouching')
JITTER_DEG = 5.0
JITTER_MAX_DEG = 15.0


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
        pose = ScenePose(kind, _jittered(pose.body_pose, rng), pose.tilt)
        if rng.random() < 0.5:
            pose = mirrored(pose)
        if limbs_clear(model, pose.body_pose):
            return pose
    return pose


def mirrored(pose: ScenePose) -> ScenePose:
    """Return the pose of the mirror image, left for right."""
    swapped = pose.body_pose[MIRROR[1:] - 1] * np.array([1.0, -1.0, -1.0])
    return ScenePose(pose.kind, swapped, pose.tilt * np.array([1.0, -1.0, -1.0]))


def limbs_clear(model: BodyModel, body_pose: Float[np.ndarray, '23 3']) -> bool:
    """Return whether forearms, hands and shins run outside torso, thighs and each other."""
    p = joints(model, BodyParameters(
        np.zeros(3), np.zeros(3), body_pose, np.zeros(model.n_betas)))
    for first, second, clearance_m in _CLEARANCES:
        a = _along(p, *first)
        b = _along(p, *second)
        gap = np.linalg.norm(a[:, None] - b[None], axis=2).min()
        if gap < clearance_m:
            return False
    return True


def walking_pose(
    model: BodyModel, phase_rad: float, stride: float = 1.0, arms: float = 1.0
) -> Float[np.ndarray, '23 3']:
    """Return a moment of a walk; `phase_rad` runs through 2 pi per pair of steps."""
    pose = _standing_base(model, np.array([0.06, -0.03]))
    for side, phase in (('left', phase_rad), ('right', phase_rad + np.pi)):
        swing = np.sin(phase)
        lifted = np.clip(np.cos(phase), 0.0, 1.0)  # the leg moves forward while its sine grows
        _flex(pose, f'{side}_hip', np.deg2rad(stride * (26 * swing + 14 * lifted)))
        _flex(pose, f'{side}_knee', -np.deg2rad(6 + stride * (48 * lifted + 6 * max(0.0, -swing))))
        _flex(pose, f'{side}_ankle', np.deg2rad(stride * (8 * lifted - 10 * max(0.0, -swing))))
        other = 'right' if side == 'left' else 'left'
        arm = np.deg2rad(arms * 24 * swing)
        index = JOINT_INDEX[f'{other}_shoulder'] - 1
        forward = from_rotvec(np.array([-arm, 0.0, 0.0]))
        pose[index] = to_rotvec(forward @ from_rotvec(pose[index]))
        sign = 1.0 if other == 'left' else -1.0
        pose[JOINT_INDEX[f'{other}_elbow'] - 1] = [0.0, -sign * (0.25 + 0.3 * max(0.0, arm)), 0.0]
    _set(pose, 'spine2', [0.0, np.deg2rad(5) * np.sin(phase_rad), 0.0])
    return pose


def _draw_standing(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = _standing_base(model, rng.uniform([0.0, -0.06], [0.16, 0.06]))
    _flex(pose, 'left_hip', rng.uniform(-0.1, 0.25))
    _flex(pose, 'left_knee', -rng.uniform(0.0, 0.35))
    _look_around(pose, rng)
    for side in ('left', 'right'):
        pose = _arm(model, pose, side, rng.choice(_STANDING_ARMS, p=_STANDING_ARM_SHARES), rng)
    return ScenePose('standing', pose, np.zeros(3))


def _draw_walking(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = walking_pose(model, rng.uniform(0, 2 * np.pi), rng.uniform(0.5, 1.3),
                        rng.uniform(0.3, 1.4))
    _look_around(pose, rng)
    if rng.random() < 0.3:
        pose = _arm(model, pose, 'left', rng.choice(_STANDING_ARMS), rng)
    return ScenePose('walking', pose, np.array([rng.uniform(-0.02, 0.12), 0.0, 0.0]))


def _draw_seated(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    lean = rng.uniform(-0.25, 0.3)
    pose = _standing_base(model, rng.uniform([0.02, -0.05], [0.3, 0.05]))
    for side in ('left', 'right'):
        _flex(pose, f'{side}_hip', np.deg2rad(rng.uniform(78, 95)) + lean * 0.5)
        _flex(pose, f'{side}_knee', -np.deg2rad(rng.uniform(65, 100)))
    _bend_spine(pose, rng.uniform(0.0, 0.5))
    _look_around(pose, rng)
    style = rng.choice(
        ['thigh', 'forward', 'folded', 'face', 'hang'], p=[0.45, 0.2, 0.15, 0.1, 0.1])
    for side in ('left', 'right'):
        if rng.random() < 0.25:
            style = rng.choice(['thigh', 'forward', 'face'])
        pose = _arm(model, pose, side, style, rng)
    return ScenePose('seated', pose, np.array([lean, 0.0, 0.0]))


def _draw_lying(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = _standing_base(model, rng.uniform([0.0, -0.05], [0.25, 0.05]))
    bend = rng.uniform(0.0, 1.0) if rng.random() < 0.5 else 0.1
    for side in ('left', 'right'):
        share = rng.uniform(0.7, 1.0)
        _flex(pose, f'{side}_hip', bend * share)
        _flex(pose, f'{side}_knee', -bend * share * 1.7)
    _look_around(pose, rng)
    for side in ('left', 'right'):
        pose = _arm(model, pose, side, rng.choice(['hang', 'folded', 'out']), rng)
    on_back = from_rotvec(np.array([-np.pi / 2, 0.0, 0.0]))
    roll = rng.choice([0.0, np.pi / 2, -np.pi / 2], p=[0.5, 0.25, 0.25]) + rng.normal(0, 0.15)
    return ScenePose('lying', pose, to_rotvec(on_back @ from_rotvec(np.array([0.0, roll, 0.0]))))


def _draw_reaching(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = _standing_base(model, rng.uniform([0.02, -0.05], [0.2, 0.05]))
    _bend_spine(pose, rng.uniform(-0.1, 0.4))
    _flex(pose, 'left_hip', rng.uniform(0.0, 0.4))
    _flex(pose, 'left_knee', -rng.uniform(0.0, 0.4))
    _look_around(pose, rng)
    pose = _arm(model, pose, 'left', rng.choice(['forward', 'up', 'out', 'high']), rng)
    pose = _arm(model, pose, 'right', rng.choice(['hang', 'forward', 'up', 'hip']), rng)
    return ScenePose('reaching', pose, np.array([rng.uniform(-0.05, 0.15), 0.0, 0.0]))


def _draw_bending(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = _standing_base(model, rng.uniform([0.02, -0.05], [0.2, 0.05]))
    tilt = rng.uniform(0.3, 1.0)
    for side in ('left', 'right'):
        knee = rng.uniform(0.1, 0.6)
        _flex(pose, f'{side}_hip', tilt + 0.5 * knee)
        _flex(pose, f'{side}_knee', -knee)
    _bend_spine(pose, rng.uniform(0.2, 0.9))
    for side in ('left', 'right'):
        pose = _arm(model, pose, side, rng.choice(['forward', 'down', 'thigh']), rng)
    return ScenePose('bending', pose, np.array([tilt, 0.0, 0.0]))


def _draw_crouching(model: BodyModel, rng: np.random.Generator) -> ScenePose:
    pose = _standing_base(model, rng.uniform([0.1, -0.05], [0.4, 0.05]))
    tilt = rng.uniform(0.1, 0.5)
    for side in ('left', 'right'):
        knee = np.deg2rad(rng.uniform(95, 135))
        _flex(pose, f'{side}_hip', knee * 0.62 + tilt + rng.uniform(0.1, 0.3))
        _flex(pose, f'{side}_knee', -knee)
        _flex(pose, f'{side}_ankle', 0.3)
    _bend_spine(pose, rng.uniform(0.1, 0.6))
    _look_around(pose, rng)
    for side in ('left', 'right'):
        pose = _arm(model, pose, side, rng.choice(['forward', 'thigh', 'face']), rng)
    return ScenePose('crouching', pose, np.array([tilt, 0.0, 0.0]))


_DRAWS: dict[str, Callable[[BodyModel, np.random.Generator], ScenePose]] = {
    'standing': _draw_standing, 'walking': _draw_walking, 'seated': _draw_seated,
    'lying': _draw_lying, 'reaching': _draw_reaching, 'bending': _draw_bending,
    'crouching': _draw_crouching,
}
_STANDING_ARMS = ['hang', 'hip', 'folded', 'forward', 'face', 'up', 'out']
_STANDING_ARM_SHARES = [0.42, 0.12, 0.12, 0.14, 0.1, 0.05, 0.05]
# Segments (from, to, share of the way where it starts) and the gap they keep [m].
_CLEARANCES = (
    (('left_elbow', 'left_wrist', 0.3), ('pelvis', 'neck', 0.0), 0.15),
    (('right_elbow', 'right_wrist', 0.3), ('pelvis', 'neck', 0.0), 0.15),
    (('left_elbow', 'left_hand', 0.4), ('left_hip', 'left_knee', 0.0), 0.10),
    (('right_elbow', 'right_hand', 0.4), ('right_hip', 'right_knee', 0.0), 0.10),
    (('left_elbow', 'left_hand', 0.4), ('right_hip', 'right_knee', 0.0), 0.10),
    (('right_elbow', 'right_hand', 0.4), ('left_hip', 'left_knee', 0.0), 0.10),
    (('left_elbow', 'left_hand', 0.2), ('right_elbow', 'right_hand', 0.2), 0.07),
    (('left_elbow', 'left_hand', 0.2), ('neck', 'head', 0.5), 0.12),
    (('right_elbow', 'right_hand', 0.2), ('neck', 'head', 0.5), 0.12),
    (('left_knee', 'left_ankle', 0.0), ('right_knee', 'right_ankle', 0.0), 0.10),
    (('left_knee', 'left_ankle', 0.5), ('right_hip', 'right_knee', 0.0), 0.12),
    (('right_knee', 'right_ankle', 0.5), ('left_hip', 'left_knee', 0.0), 0.12),
)


def _along(
    p: Float[np.ndarray, '24 3'], start: str, end: str, share: float
) -> Float[np.ndarray, '7 3']:
    steps = np.linspace(share, 1.0, 7)[:, None]
    return p[JOINT_INDEX[start]] * (1 - steps) + p[JOINT_INDEX[end]] * steps


def _standing_base(
    model: BodyModel, legs: Float[np.ndarray, '2']
) -> Float[np.ndarray, '23 3']:
    """Return arms hanging, with legs spread and turned by `legs` (abduction, rotation) [rad]."""
    pose = np.zeros((23, 3))
    for side, sign in (('left', 1.0), ('right', -1.0)):
        _set(pose, f'{side}_hip', [0.0, sign * legs[1], sign * legs[0]])
    for side in ('left', 'right'):
        pose = _arm(model, pose, side, 'hang', np.random.default_rng(0))
    return pose


def _arm(
    model: BodyModel, pose: Float[np.ndarray, '23 3'], side: str, style: str,
    rng: np.random.Generator,
) -> Float[np.ndarray, '23 3']:
    """Return the pose with one arm in a style; targets are relative to joints of the mean body."""
    p = joints(model, BodyParameters(np.zeros(3), np.zeros(3), pose, np.zeros(model.n_betas)))
    out = 1.0 if side == 'left' else -1.0
    anchor, low, high, elbow = _ARM_TARGETS[style]
    offset = rng.uniform(low, high)
    name = anchor if anchor in JOINT_INDEX else f'{side}_{anchor}'
    target = p[JOINT_INDEX[name]] + offset * np.array([out, 1.0, 1.0])
    if style == 'thigh':
        target = target + rng.uniform(0.0, 0.45) * (
            p[JOINT_INDEX[f'{side}_hip']] - p[JOINT_INDEX[f'{side}_knee']])
    return reach(model, pose, side, target, np.array(elbow) * np.array([out, 1.0, 1.0]))


# Wrist target relative to a joint: low and high corner of a box [m] (x outward), elbow direction.
_ARM_TARGETS = {
    'hang': ('hip', [0.08, -0.20, -0.05], [0.18, -0.06, 0.14], [0.25, 0.0, -1.0]),
    'hip': ('hip', [0.10, 0.06, 0.02], [0.14, 0.12, 0.08], [1.0, 0.0, -0.4]),
    'folded': ('spine2', [-0.16, -0.02, 0.20], [0.04, 0.14, 0.30], [0.8, -1.0, 0.1]),
    'forward': ('shoulder', [-0.15, -0.35, 0.28], [0.20, 0.05, 0.58], [0.5, -1.0, 0.0]),
    'face': ('head', [0.02, -0.06, 0.14], [0.14, 0.10, 0.26], [0.7, -1.0, 0.2]),
    'up': ('shoulder', [0.0, 0.30, -0.05], [0.30, 0.55, 0.20], [1.0, 0.0, 0.1]),
    'high': ('shoulder', [-0.05, 0.15, 0.25], [0.20, 0.45, 0.45], [1.0, -0.5, 0.0]),
    'out': ('shoulder', [0.35, -0.20, -0.10], [0.55, 0.20, 0.30], [0.0, -1.0, -0.4]),
    'down': ('shoulder', [-0.05, -0.15, 0.30], [0.15, 0.0, 0.60], [1.0, -0.2, 0.0]),
    'thigh': ('knee', [-0.03, 0.10, -0.02], [0.05, 0.13, 0.04], [0.8, 0.0, -0.6]),
}


def _look_around(pose: Float[np.ndarray, '23 3'], rng: np.random.Generator) -> None:
    turn, nod = rng.normal(0, 0.3), rng.normal(0.05, 0.15)
    for name in ('neck', 'head'):
        _set(pose, name, [nod / 2, turn / 2, rng.normal(0, 0.05)])
    twist = rng.normal(0, 0.1)
    for name in ('spine1', 'spine2', 'spine3'):
        pose[JOINT_INDEX[name] - 1] += [0.0, twist / 3, rng.normal(0, 0.03)]


def _bend_spine(pose: Float[np.ndarray, '23 3'], angle_rad: float) -> None:
    for name in ('spine1', 'spine2', 'spine3'):
        pose[JOINT_INDEX[name] - 1, 0] += angle_rad / 3


def _flex(pose: Float[np.ndarray, '23 3'], name: str, angle_rad: float) -> None:
    """Turn a leg joint so that the limb below swings forward."""
    pose[JOINT_INDEX[name] - 1, 0] -= angle_rad


def _set(pose: Float[np.ndarray, '23 3'], name: str, rotvec: list[float]) -> None:
    pose[JOINT_INDEX[name] - 1] = rotvec


def _jittered(
    pose: Float[np.ndarray, '23 3'], rng: np.random.Generator
) -> Float[np.ndarray, '23 3']:
    """Return the pose with every joint turned a little; hinges never bend backward."""
    bound = np.deg2rad(JITTER_MAX_DEG)
    noise = np.clip(rng.normal(0, np.deg2rad(JITTER_DEG), (23, 3)), -bound, bound)
    for name in ('left_foot', 'right_foot', 'spine1', 'spine2', 'spine3'):
        noise[JOINT_INDEX[name] - 1] *= 0.4
    for side, sign in (('left', -1.0), ('right', 1.0)):
        knee, elbow = JOINT_INDEX[f'{side}_knee'] - 1, JOINT_INDEX[f'{side}_elbow'] - 1
        noise[knee, 1:] = 0.0
        noise[elbow, [0, 2]] = 0.0
        noise[knee, 0] = max(noise[knee, 0], 0.02 - pose[knee, 0])
        noise[elbow, 1] = sign * max(sign * noise[elbow, 1], 0.02 - sign * pose[elbow, 1])
    return pose + noise
