"""Left taken for right: other readings of a body whose joints stay nearly where they are.

Two legs look alike from the side, and detectors take backs for fronts. The joints of one side are
then fitted to what the other side shows, and no small step leads from there to the truth.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import mirrored_pose
from pop_core.body.joints import JOINT_INDEX, MIRROR, PARENTS
from pop_core.body.kinematics import PosedSkeleton, pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.bone_rolls import LIMBS, HingedLimb, easiest_reading
from pop_core.geometry.rotation import from_rotvec, to_rotvec

LEGS = LIMBS[:2]
TRUNK = [JOINT_INDEX[name] - 1 for name in ('spine1', 'spine2', 'spine3', 'neck', 'head')]
HALF_TURN = np.diag([-1.0, 1.0, -1.0])  # about the body's up axis


def with_legs_exchanged(model: BodyModel, parameters: BodyParameters) -> BodyParameters:
    """Return a body whose left leg takes the place of the right one, and the other way round."""
    skeleton = pose_skeleton(model, parameters)
    pose = parameters.body_pose.copy()
    feet = [limb.end - 1 for limb in LEGS]
    pose[feet] = mirrored_pose(pose)[feet]
    exchanged = parameters.replaced(body_pose=pose)
    return _reaching(model, exchanged, LEGS, skeleton.p[MIRROR])


def turned_around(model: BodyModel, parameters: BodyParameters) -> BodyParameters:
    """Return a body that shows its back where it showed its front, limbs where limbs were.

    The trunk turns by half a turn about its own up axis and bends the same way as before for
    whoever looks at it; left limbs reach for where the right ones were.
    """
    skeleton = pose_skeleton(model, parameters)
    pose = mirrored_pose(parameters.body_pose)
    bends = HALF_TURN @ skeleton.R_local[1:][TRUNK] @ HALF_TURN
    pose[TRUNK] = to_rotvec(bends)
    root = to_rotvec(from_rotvec(parameters.global_orient) @ HALF_TURN)
    turned = parameters.replaced(global_orient=root, body_pose=pose)
    return _reaching(model, turned, LIMBS, skeleton.p[MIRROR])


def _reaching(
    model: BodyModel,
    parameters: BodyParameters,
    limbs: tuple[HingedLimb, ...],
    targets: Float[np.ndarray, '24 3'],
) -> BodyParameters:
    """Return a body whose limbs point at targets [m], bone by bone, and bend as limbs do."""
    skeleton = pose_skeleton(model, parameters)
    pose = parameters.body_pose.copy()
    for limb in limbs:
        rows = [limb.upper - 1, limb.hinge - 1]
        pose[rows] = easiest_reading(
            limb, _pointing(limb, skeleton, targets), skeleton.rest_joints)
    return parameters.replaced(body_pose=pose)


def _pointing(
    limb: HingedLimb, skeleton: PosedSkeleton, targets: Float[np.ndarray, '24 3']
) -> Float[np.ndarray, '2 3']:
    """Return rotations of upper bone and hinge [rad] that point both bones at their targets."""
    upper_bone, lower_bone = limb.bones(skeleton.rest_joints)
    G, start = skeleton.G[PARENTS[limb.upper]], skeleton.p[limb.upper]
    upper = _shortest_turn(upper_bone, G.T @ (targets[limb.hinge] - start))
    G = G @ from_rotvec(upper)
    hinge = start + G @ upper_bone
    return np.stack([upper, _shortest_turn(lower_bone, G.T @ (targets[limb.end] - hinge))])


def _shortest_turn(
    a: Float[np.ndarray, '3'], b: Float[np.ndarray, '3']
) -> Float[np.ndarray, '3']:
    """Return the smallest rotation vector that turns direction a to direction b [rad]."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9 * float(np.linalg.norm(a) * np.linalg.norm(b)):
        # Opposite directions: any axis square to both will do.
        axis = np.cross(a, np.eye(3)[np.argmin(np.abs(a))])
        return axis / np.linalg.norm(axis) * (np.pi if a @ b < 0 else 0.0)
    return axis / sine * np.arctan2(sine, a @ b)
