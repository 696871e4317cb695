"""People as REP-155 tells them below /humans/bodies: ids, region, picture, 2D skeleton, joints.

`libhri` and what builds on it subscribe these topics. Coordinates of images are shares of width
and height: the outer edge of the first pixel is 0, that of the last is 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header

from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame
from pop_ros.image_messages import color_message
from pop_ros.interop_hri_joints import joint_angles
from pop_ros.interop_person import Person

# In the order of hri_msgs/Skeleton2D.
SKELETON_NAMES = (
    'nose', 'neck', 'right_shoulder', 'right_elbow', 'right_wrist', 'left_shoulder',
    'left_elbow', 'left_wrist', 'right_hip', 'right_knee', 'right_ankle', 'left_hip',
    'left_knee', 'left_ankle', 'left_eye', 'right_eye', 'left_ear', 'right_ear',
)


def ids_message(body_ids: Sequence[str], header: Header, hri_msgs: Any) -> Any:
    """Return the IdsList of the bodies that are tracked."""
    return hri_msgs.IdsList(header=header, ids=list(body_ids))


def skeleton_message(person: Person, header: Header, hri_msgs: Any) -> Any:
    """Return a Skeleton2D; points outside the image stand at its edge with confidence 0."""
    rows = person.rows(SKELETON_NAMES)
    inside = person.in_image[rows]
    uv = np.nan_to_num(person.uv[rows])
    shares = np.clip((uv + 0.5) / _size(person.camera), 0, 1)
    confidence = np.where(inside, person.confidence[rows], 0)
    return hri_msgs.Skeleton2D(header=header, skeleton=[
        hri_msgs.NormalizedPointOfInterest2D(x=float(x), y=float(y), c=float(c))
        for (x, y), c in zip(shares, confidence, strict=True)])


def region_message(person: Person, header: Header, hri_msgs: Any) -> Any:
    """Return the NormalizedRegionOfInterest2D around the mesh; empty outside the image."""
    message = hri_msgs.NormalizedRegionOfInterest2D(header=header)
    if person.box_px is not None:
        low, high = person.box_px.reshape(2, 2)
        message.xmin, message.ymin = ((low + 0.5) / _size(person.camera)).tolist()
        message.xmax, message.ymax = ((high + 0.5) / _size(person.camera)).tolist()
        message.c = float(person.body.score)
    return message


def cropped_message(person: Person, frame: RgbdFrame, header: Header) -> Image:
    """Return the colour image's part around the mesh; empty outside the image."""
    if person.box_px is None:
        return Image(header=header, encoding='rgb8')
    left, top = np.floor(person.box_px[:2]).astype(int)
    right, bottom = np.ceil(person.box_px[2:]).astype(int) + 1
    return color_message(frame.rgb[top:bottom, left:right], header)


def joint_states_message(person: Person, body_id: str, header: Header) -> JointState:
    """Return the angles [rad] of REP-155's kinematic model of a human."""
    angles = joint_angles(person.body.joints, person.body.joint_rotations)
    return JointState(
        header=header, name=[f'{name}_{body_id}' for name in angles],
        position=list(angles.values()))


def _size(camera: Camera) -> np.ndarray:
    return np.array([camera.width, camera.height], np.float64)
