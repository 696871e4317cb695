"""Messages of pop_msgs, where that package is installed: everything known about each person."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from std_msgs.msg import Header

from pop_core.body.joints import JOINT_NAMES
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.model_digest import model_digest
from pop_core.estimate import BodyEstimate, JointState
from pop_ros.message_packages import message_module
from pop_ros.to_messages import body_poses

pop_msgs = message_module('pop_msgs')
HALF_CONFIDENCE_M = 0.1  # standard deviation at which a joint's confidence is one half


def bodies_message(
    bodies: Sequence[BodyEstimate], ids: Sequence[int], header: Header
) -> Any:
    """Return a pop_msgs/BodyArray."""
    return pop_msgs.BodyArray(
        header=header, bodies=[_body(b, i) for b, i in zip(bodies, ids, strict=True)])


def model_message(model: BodyModel, header: Header) -> Any:
    """Return the pop_msgs/BodyModel whose poses the bodies are."""
    return pop_msgs.BodyModel(
        header=header, name=model.name, digest=model_digest(model),
        joint_names=list(JOINT_NAMES),
        parents=model.parents.tolist(), vertex_count=len(model.v_template),
        faces=model.f.astype(np.uint32).ravel())


def joint_confidence(covariance: Float[np.ndarray, 'j 3 3']) -> Float[np.ndarray, 'j']:
    """Return 1 for certain positions, falling with their variance [m^2] per axis."""
    variance = np.trace(covariance, axis1=1, axis2=2) / 3
    return np.asarray(1 / (1 + variance / HALF_CONFIDENCE_M**2))


def definition_files() -> list[Path]:
    """Return the .msg files of the installed pop_msgs; none without it."""
    if pop_msgs is None:
        return []
    from ament_index_python.packages import get_package_share_directory
    return sorted((Path(get_package_share_directory('pop_msgs')) / 'msg').glob('*.msg'))


def parameters_of(message: Any) -> BodyParameters:
    """Return the parameters of a pop_msgs/BodyParameters."""
    return BodyParameters(
        transl=np.array(message.transl, np.float64),
        global_orient=np.array(message.global_orient, np.float64),
        body_pose=np.array(message.body_pose, np.float64).reshape(23, 3),
        betas=np.array(message.betas, np.float64), scale=float(message.scale))


def _body(body: BodyEstimate, person_id: int) -> Any:
    track = body.track
    return pop_msgs.Body(
        id=person_id, score=body.score,
        track_state=pop_msgs.Body.NOT_TRACKED if track is None else int(track.state),
        age_s=0.0 if track is None else track.age_s,
        unseen_s=0.0 if track is None else track.unseen_s,
        visible_fraction=float(np.mean(body.joint_state == JointState.VISIBLE)),
        parameters=_parameters(body.parameters), joints=_joints(body),
        energy_names=list(body.energies), energies=list(body.energies.values()))


def _parameters(parameters: BodyParameters) -> Any:
    return pop_msgs.BodyParameters(
        transl=parameters.transl.astype(np.float32),
        global_orient=parameters.global_orient.astype(np.float32),
        body_pose=parameters.body_pose.astype(np.float32).ravel(),
        betas=parameters.betas.astype(np.float32), scale=parameters.scale)


def _joints(body: BodyEstimate) -> list[Any]:
    confidence = joint_confidence(body.joint_covariance)
    return [
        pop_msgs.BodyJoint(
            pose=pose, state=int(state), confidence=float(sure),
            covariance=covariance.astype(np.float32).ravel())
        for pose, state, sure, covariance in zip(
            body_poses(body), body.joint_state, confidence, body.joint_covariance, strict=True)
    ]
