"""Two-bone inverse kinematics that puts a wrist where a pose wants it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.geometry.rotation import to_rotvec
from pop_core.synthesis.two_bones import bend, bone_frame


def reach(
    model: BodyModel, body_pose: Float[np.ndarray, '23 3'], side: str,
    wrist_body: Float[np.ndarray, '3'], elbow_toward: Float[np.ndarray, '3'],
) -> Float[np.ndarray, '23 3']:
    """Return the pose with one arm bent so that its wrist reaches a point of the body frame.

    Works on the mean body: a pose is drawn before the shape that will wear it.

    Args:
        model: Body whose proportions are used.
        body_pose: Pose so far; only this arm's shoulder and elbow change.
        side: 'left' or 'right'.
        wrist_body: Target [m], body frame; brought nearer when out of reach.
        elbow_toward: Direction into which the elbow points aside.
    """
    shoulder, elbow, wrist = (
        JOINT_INDEX[f'{side}_{name}'] for name in ('shoulder', 'elbow', 'wrist'))
    parameters = BodyParameters(np.zeros(3), np.zeros(3), body_pose, np.zeros(model.n_betas))
    skeleton = pose_skeleton(model, parameters)
    rest = skeleton.rest_joints
    upper_m = float(np.linalg.norm(rest[elbow] - rest[shoulder]))
    lower_m = float(np.linalg.norm(rest[wrist] - rest[elbow]))
    upper, lower = bend(
        wrist_body - skeleton.p[shoulder], elbow_toward, upper_m, lower_m)
    outward = 1.0 if side == 'left' else -1.0
    R_body_shoulder = bone_frame(upper, np.cross(upper, lower)) @ bone_frame(
        np.array([outward, 0.0, 0.0]), np.array([0.0, -outward, 0.0])).T
    parent = skeleton.G[int(model.parents[shoulder])]
    angle = float(np.arccos(np.clip(upper @ lower, -1.0, 1.0)))
    out = body_pose.copy()
    out[shoulder - 1] = to_rotvec(parent.T @ R_body_shoulder)
    out[elbow - 1] = [0.0, -outward * angle, 0.0]
    return out
