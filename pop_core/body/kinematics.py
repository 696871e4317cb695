"""Forward kinematics of the body tree: joint positions, orientations and their Jacobian."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body import skinning_kernels as kernels
from pop_core.body.kinematics_kernels import pose_tree, turned
from pop_core.body.model import AttachedPoints, BodyModel, BodyParameters, joint_points


@dataclass(frozen=True, slots=True, eq=False)
class PosedSkeleton:
    """The tree after shaping and posing, before scale and translation.

    Args:
        R_local: Rotation of each joint relative to its parent.
        rest_joints: Joints of the shaped body in T-pose [m].
        G: Rotation of each joint relative to the outer frame.
        p: Joint positions [m], root at its rest place.
    """

    R_local: Float[np.ndarray, '24 3 3']
    rest_joints: Float[np.ndarray, '24 3']
    G: Float[np.ndarray, '24 3 3']
    p: Float[np.ndarray, '24 3']


def pose_skeleton(model: BodyModel, parameters: BodyParameters) -> PosedSkeleton:
    """Return the posed tree of a body."""
    return PosedSkeleton(*pose_tree(
        parameters.global_orient, parameters.body_pose, parameters.betas, model.joint_template,
        model.joint_shapedirs, model.parents))


def joints(model: BodyModel, parameters: BodyParameters) -> Float[np.ndarray, '24 3']:
    """Return the 24 joints [m] in the parameters' outer frame."""
    skeleton = pose_skeleton(model, parameters)
    return parameters.scale * skeleton.p + parameters.transl


def joint_rotations(model: BodyModel, parameters: BodyParameters) -> Float[np.ndarray, '24 3 3']:
    """Return the orientation of each joint's frame in the parameters' outer frame."""
    return pose_skeleton(model, parameters).G


def attached_positions(
    points: AttachedPoints, model: BodyModel, parameters: BodyParameters
) -> Float[np.ndarray, 'n 3']:
    """Return points carried by joints [m] in the parameters' outer frame."""
    places = attached_places(points, pose_skeleton(model, parameters), parameters.betas)
    return parameters.scale * places + parameters.transl


def attached_places(
    points: AttachedPoints, skeleton: PosedSkeleton, betas: Float[np.ndarray, 'b']
) -> Float[np.ndarray, 'n 3']:
    """Return points carried by joints of a posed tree [m], before scale and translation."""
    return np.asarray(kernels.attached_places(
        points.joint, points.template, points.shapedirs, betas, skeleton.rest_joints, skeleton.G,
        skeleton.p))


def attached_jacobian(
    points: AttachedPoints, model: BodyModel, parameters: BodyParameters, skeleton: PosedSkeleton
) -> Float[np.ndarray, 'n 3 x']:
    """Return d(position)/d(transl, rotation increments, betas, log scale) of attached points."""
    _, e = kernels.joint_shape_derivatives(skeleton.G, model.joint_shapedirs, model.parents)
    places = attached_places(points, skeleton, parameters.betas)
    out = np.empty((len(points.joint), 3, 3 + 72 + model.n_betas + 1))
    kernels.attached_jacobian(
        points.joint, places, points.shapedirs, skeleton.G, skeleton.p, e, model.parents,
        parameters.scale, out,
    )
    return out


def joints_jacobian(
    model: BodyModel, parameters: BodyParameters, skeleton: PosedSkeleton
) -> Float[np.ndarray, '24 3 x']:
    """Return d(joints)/d(transl, rotation increments, betas, log scale)."""
    return attached_jacobian(joint_points(model), model, parameters, skeleton)


def increment(
    parameters: BodyParameters, step: Float[np.ndarray, 'x'], skeleton: PosedSkeleton
) -> BodyParameters:
    """Return parameters after a step; rotations turn from the left, in their parent's frame."""
    rotvecs = turned(step[3:75].reshape(24, 3), skeleton.R_local)
    return BodyParameters(
        transl=parameters.transl + step[:3],
        global_orient=rotvecs[0],
        body_pose=rotvecs[1:],
        betas=parameters.betas + step[75:-1],
        scale=float(parameters.scale * np.exp(step[-1])),
    )
