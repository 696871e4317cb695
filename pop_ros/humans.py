"""REP-155 below /humans/bodies: topics and TF frames that come and go with each body.

A body's id is the node's name and the person's number, so that several nodes may share /humans.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from jaxtyping import Float
from rclpy.node import Node
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Header

from pop_core.geometry.rotation import to_quat_xyzw
from pop_core.rgbd import RgbdFrame
from pop_ros import interop_hri
from pop_ros.interop_hri_joints import link_frames
from pop_ros.interop_person import Person
from pop_ros.message_packages import message_module
from pop_ros.qos import output_qos
from pop_ros.tf_messages import tf2_msgs

HUMANS = 'humans'  # the one output that is many topics
ROOT = '/humans/bodies'
Place = tuple[Float[np.ndarray, '3'], Float[np.ndarray, '3 3']]


@dataclass(frozen=True, slots=True, eq=False)
class HumansFrame:
    """The people of one image, yet to be told in whatever form somebody listens to.

    Args:
        people: Who is there.
        frame: The image.
        header: Its stamp and frame.
    """

    people: Sequence[Person]
    frame: RgbdFrame
    header: Header


class HumansTopics:
    """Publishers below /humans; they exist while REP-155 is switched on."""

    def __init__(self, node: Node) -> None:
        """Advertise nothing yet."""
        self._node = node
        self._prefix = node.get_fully_qualified_name().strip('/').replace('/', '_')
        self._hri_msgs = message_module('hri_msgs')
        # The executor's thread asks who listens while the worker's thread publishes.
        self._lock = threading.Lock()
        self._common: dict[str, Any] = {}
        self._bodies: dict[str, dict[str, Any]] = {}

    def switch(self, is_on: bool) -> None:
        """Advertise what is there without people, or take everything back."""
        with self._lock:
            if is_on and not self._common:
                self._common['tracked'] = self._publisher(self._hri_msgs.IdsList, 'tracked')
                if tf2_msgs is not None:
                    self._common['tf'] = self._node.create_publisher(
                        tf2_msgs.TFMessage, '/tf', output_qos())
            elif not is_on and self._common:
                self._destroy(self._common)
                for publishers in self._bodies.values():
                    self._destroy(publishers)
                self._bodies.clear()

    def is_heard(self) -> bool:
        """Return whether somebody subscribes any of the topics."""
        with self._lock:
            every = [self._common, *self._bodies.values()]
            return any(p.get_subscription_count() for group in every for p in group.values())

    def publish(self, seen: HumansFrame) -> None:
        """Publish the list of bodies, and of each body what is listened to."""
        with self._lock:
            if not self._common:
                return
            people = {f'{self._prefix}_{person.id}': person for person in seen.people}
            self._follow(list(people))
            self._common['tracked'].publish(
                interop_hri.ids_message(list(people), seen.header, self._hri_msgs))
            for body_id, person in people.items():
                for name, make in self._makers(body_id, person, seen).items():
                    if self._bodies[body_id][name].get_subscription_count():
                        self._bodies[body_id][name].publish(make())
            if people and 'tf' in self._common:
                self._common['tf'].publish(tf2_msgs.TFMessage(transforms=[
                    transform for body_id, person in people.items()
                    for transform in body_transforms(person, body_id, seen.header)]))

    def _makers(
        self, body_id: str, person: Person, seen: HumansFrame
    ) -> dict[str, Callable[[], Any]]:
        header, hri_msgs = seen.header, self._hri_msgs
        return {
            'roi': lambda: interop_hri.region_message(person, header, hri_msgs),
            'cropped': lambda: interop_hri.cropped_message(person, seen.frame, header),
            'skeleton2d': lambda: interop_hri.skeleton_message(person, header, hri_msgs),
            'joint_states': lambda: interop_hri.joint_states_message(person, body_id, header),
        }

    def _follow(self, body_ids: Sequence[str]) -> None:
        """Advertise the topics of new bodies and take back those of bodies that have left."""
        for gone in set(self._bodies) - set(body_ids):
            self._destroy(self._bodies.pop(gone))
        hri_msgs = self._hri_msgs
        kinds = {
            'roi': hri_msgs.NormalizedRegionOfInterest2D, 'cropped': Image,
            'skeleton2d': hri_msgs.Skeleton2D, 'joint_states': JointState}
        for new in set(body_ids) - set(self._bodies):
            self._bodies[new] = {
                name: self._publisher(kind, f'{new}/{name}') for name, kind in kinds.items()}

    def _publisher(self, kind: Any, name: str) -> Any:
        return self._node.create_publisher(kind, f'{ROOT}/{name}', output_qos())

    def _destroy(self, publishers: dict[str, Any]) -> None:
        for publisher in publishers.values():
            self._node.destroy_publisher(publisher)
        publishers.clear()


def body_transforms(person: Person, body_id: str, header: Header) -> list[TransformStamped]:
    """Return the frame body_<id> in the camera's frame, and all other links' in body_<id>."""
    links = link_frames(person.body.joints, person.body.joint_rotations)
    body, R_camera_body = links.pop('body')
    found = [_transform(header, f'body_{body_id}', (body, R_camera_body))]
    inside = Header(stamp=header.stamp, frame_id=f'body_{body_id}')
    for name, (place, R) in links.items():
        relative = R_camera_body.T @ (place - body), R_camera_body.T @ R
        found.append(_transform(inside, f'{name}_{body_id}', relative))
    return found


def _transform(header: Header, child: str, place: Place) -> TransformStamped:
    (x, y, z), R = place
    qx, qy, qz, qw = to_quat_xyzw(R[None])[0].tolist()
    return TransformStamped(
        header=header, child_frame_id=child, transform=Transform(
            translation=Vector3(x=float(x), y=float(y), z=float(z)),
            rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)))
