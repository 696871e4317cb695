"""Two-bone inverse kinematics that puts a wrist where a pose wants it."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.geometry.rotation import to_rotvec

MAX_STRETCH = 0.985  # of the straight arm: a locked elbow has no hinge plane


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
    upper, lower = _bend(
        wrist_body - skeleton.p[shoulder], elbow_toward, upper_m, lower_m)
    outward = 1.0 if side == 'left' else -1.0
    R_body_shoulder = _arm_frame(upper, lower) @ _arm_frame(
        np.array([outward, 0.0, 0.0]), np.array([outward * 0.8, 0.0, 0.6])).T
    parent = skeleton.G[int(model.parents[shoulder])]
    angle = float(np.arccos(np.clip(upper @ lower, -1.0, 1.0)))
    out = body_pose.copy()
    out[shoulder - 1] = to_rotvec(parent.T @ R_body_shoulder)
    out[elbow - 1] = [0.0, -outward * angle, 0.0]
    return out


def _bend(
    target: Float[np.ndarray, '3'], elbow_toward: Float[np.ndarray, '3'],
    upper_m: float, lower_m: float,
) -> tuple[Float[np.ndarray, '3'], Float[np.ndarray, '3']]:
    """Return unit directions of the upper and lower arm (law of cosines)."""
    shortest = abs(upper_m - lower_m) + 0.12
    length = float(np.linalg.norm(target))
    distance = float(np.clip(length, shortest, MAX_STRETCH * (upper_m + lower_m)))
    along = target / max(length, 1e-9)
    aside = elbow_toward - (elbow_toward @ along) * along
    aside = aside / max(float(np.linalg.norm(aside)), 1e-9)
    cosine = (upper_m**2 + distance**2 - lower_m**2) / (2 * upper_m * distance)
    cosine = float(np.clip(cosine, -1.0, 1.0))
    upper = along * cosine + aside * np.sqrt(1.0 - cosine**2)
    lower = along * distance - upper * upper_m
    return upper, lower / np.linalg.norm(lower)


def _arm_frame(
    upper: Float[np.ndarray, '3'], lower: Float[np.ndarray, '3']
) -> Float[np.ndarray, '3 3']:
    """Return columns (upper arm, hinge, hinge x upper arm)."""
    hinge = np.cross(upper, lower)
    hinge = hinge / max(float(np.linalg.norm(hinge)), 1e-9)
    return np.column_stack([upper, hinge, np.cross(upper, hinge)])
