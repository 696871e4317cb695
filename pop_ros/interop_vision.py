"""People as vision_msgs/Detection3DArray: a box around the mesh, and the pelvis as the pose."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from jaxtyping import Float
from std_msgs.msg import Header

from pop_core.body.joints import JOINT_INDEX
from pop_ros.interop_person import Person
from pop_ros.to_messages import body_poses

PERSON = 'person'
HIPS = [JOINT_INDEX['left_hip'], JOINT_INDEX['right_hip']]


def detections_message(people: Sequence[Person], header: Header, vision_msgs: Any) -> Any:
    """Return a Detection3DArray in the frame of the header."""
    return vision_msgs.Detection3DArray(
        header=header, detections=[_detection(p, header, vision_msgs) for p in people])


def box_fields(person: Person) -> dict[str, Any]:
    """Return centre [m] and size [m] of the box around the mesh, along the camera's axes."""
    low, high = person.box_m
    x, y, z = (0.5 * (low + high)).tolist()
    width, height, depth = (high - low).tolist()
    centre = Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0))
    return {'center': centre, 'size': Vector3(x=width, y=height, z=depth)}


def pose_covariance(person: Person) -> Float[np.ndarray, '6 6']:
    """Return the covariance of the pelvis: position [m^2], then rotation [rad^2].

    The fit gives no covariance of orientations; to first order a turn moves the hips by the turn
    times half their distance, so that their variance over its square is the turn's.
    """
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = person.body.joint_covariance[0]
    left, right = person.body.joints[HIPS]
    lever_m = 0.5 * np.linalg.norm(left - right)
    variance = np.trace(person.body.joint_covariance[HIPS].mean(axis=0)) / 3
    covariance[3:, 3:] = np.eye(3) * variance / lever_m**2
    return covariance


def _detection(person: Person, header: Header, vision_msgs: Any) -> Any:
    result = vision_msgs.ObjectHypothesisWithPose()
    result.hypothesis.class_id = PERSON
    result.hypothesis.score = float(person.body.score)
    result.pose.pose = body_poses(person.body)[0]
    result.pose.covariance = pose_covariance(person).ravel()
    return vision_msgs.Detection3D(
        header=header, id=f'{person.id}', results=[result],
        bbox=vision_msgs.BoundingBox3D(**box_fields(person)))
