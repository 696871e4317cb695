"""Parts that poses are made of: arms in styles, bent spines and legs, jitter, clear limbs."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.synthesis.arms import reach

JITTER_DEG = 5.0
JITTER_MAX_DEG = 15.0


def standing_base(
    model: BodyModel, legs: Float[np.ndarray, '2']
) -> Float[np.ndarray, '23 3']:
    """Return arms hanging, with legs spread and turned by `legs` (abduction, rotation) [rad]."""
    pose = np.zeros((23, 3))
    for side, sign in (('left', 1.0), ('right', -1.0)):
        set_joint(pose, f'{side}_hip', [0.0, sign * legs[1], sign * legs[0]])
    for side in ('left', 'right'):
        pose = arm_in_style(model, pose, side, 'hang', np.random.default_rng(0))
    return pose


def arm_in_style(
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


def look_around(pose: Float[np.ndarray, '23 3'], rng: np.random.Generator) -> None:
    """Turn head and trunk a little, in place."""
    turn, nod = rng.normal(0, 0.3), rng.normal(0.05, 0.15)
    for name in ('neck', 'head'):
        set_joint(pose, name, [nod / 2, turn / 2, rng.normal(0, 0.05)])
    twist = rng.normal(0, 0.1)
    for name in ('spine1', 'spine2', 'spine3'):
        pose[JOINT_INDEX[name] - 1] += [0.0, twist / 3, rng.normal(0, 0.03)]


def bend_spine(pose: Float[np.ndarray, '23 3'], angle_rad: float) -> None:
    """Bend the trunk forward by an angle in all, in place."""
    for name in ('spine1', 'spine2', 'spine3'):
        pose[JOINT_INDEX[name] - 1, 0] += angle_rad / 3


def flex(pose: Float[np.ndarray, '23 3'], name: str, angle_rad: float) -> None:
    """Turn a leg joint so that the limb below swings forward."""
    pose[JOINT_INDEX[name] - 1, 0] -= angle_rad


def set_joint(pose: Float[np.ndarray, '23 3'], name: str, rotvec: list[float]) -> None:
    """Set the rotation vector of one joint, in place."""
    pose[JOINT_INDEX[name] - 1] = rotvec


def jittered(
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


def _along(
    p: Float[np.ndarray, '24 3'], start: str, end: str, share: float
) -> Float[np.ndarray, '7 3']:
    steps = np.linspace(share, 1.0, 7)[:, None]
    return p[JOINT_INDEX[start]] * (1 - steps) + p[JOINT_INDEX[end]] * steps


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
