"""TF frames of people, where tf2_msgs is installed: body_<id>, and its joints if asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from std_msgs.msg import Header

from pop_core.body.joints import JOINT_NAMES
from pop_core.estimate import BodyEstimate
from pop_core.geometry.rotation import to_quat_xyzw
from pop_ros.message_packages import message_module

tf2_msgs = message_module('tf2_msgs')  # ROS 2 from pip lacks it


def transforms_message(
    bodies: Sequence[BodyEstimate], ids: Sequence[int], header: Header, frames: str
) -> Any:
    """Return a tf2_msgs/TFMessage from the camera's frame to every person.

    Args:
        bodies: People.
        ids: Their ids.
        header: Stamp and frame of the image.
        frames: 'people' for the pelvis of each, 'joints' for all joints too.
    """
    transforms = []
    for body, number in zip(bodies, ids, strict=True):
        quats = to_quat_xyzw(body.joint_rotations)
        names = [f'body_{number}', *(f'body_{number}/{name}' for name in JOINT_NAMES[1:])]
        for name, p, q in zip(names, body.joints.tolist(), quats.tolist(), strict=True):
            transforms.append(TransformStamped(
                header=header, child_frame_id=name,
                transform=Transform(
                    translation=Vector3(x=p[0], y=p[1], z=p[2]),
                    rotation=Quaternion(x=q[0], y=q[1], z=q[2], w=q[3]))))
            if frames == 'people':
                break
    return tf2_msgs.TFMessage(transforms=transforms)
