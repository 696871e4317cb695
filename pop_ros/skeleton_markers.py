"""Skeletons and ids as visualization_msgs/Marker: hidden joints stand out from seen ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker

from pop_core.body.joints import JOINT_INDEX, PARENTS
from pop_core.estimate import BodyEstimate, JointState
from pop_ros.to_messages import PALETTE

BONES_NAMESPACE, ID_NAMESPACE = 'pop_skeleton', 'pop_id'
BONE_WIDTH_M = 0.02
TEXT_HEIGHT_M = 0.15
ABOVE_HEAD_M = 0.3
HIDDEN = ColorRGBA(r=0.25, g=0.25, b=0.28, a=1.0)
TEXT = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)
BONES = [(joint, parent) for joint, parent in enumerate(PARENTS) if parent >= 0]


def skeleton_markers(
    bodies: Sequence[BodyEstimate], ids: Sequence[int], header: Header
) -> list[Marker]:
    """Return bones and id of every person."""
    return [marker for body, number in zip(bodies, ids, strict=True)
            for marker in (_bones(body, number, header), _id(body, number, header))]


def skeleton_removals(gone: Collection[int], header: Header) -> list[Marker]:
    """Return what removes bones and ids of those who left."""
    return [_marker(name, number, header, action=Marker.DELETE)
            for number in sorted(gone) for name in (BONES_NAMESPACE, ID_NAMESPACE)]


def _bones(body: BodyEstimate, person_id: int, header: Header) -> Marker:
    r, g, b = PALETTE[person_id % len(PALETTE)]
    seen = ColorRGBA(r=r, g=g, b=b, a=1.0)
    marker = _marker(BONES_NAMESPACE, person_id, header)
    marker.type = Marker.LINE_LIST
    marker.scale.x = BONE_WIDTH_M
    for end in np.array(BONES).ravel().tolist():
        marker.points.append(_point(body.joints[end]))
        visible = body.joint_state[end] == JointState.VISIBLE
        marker.colors.append(seen if visible else HIDDEN)
    return marker


def _id(body: BodyEstimate, person_id: int, header: Header) -> Marker:
    marker = _marker(ID_NAMESPACE, person_id, header)
    marker.type = Marker.TEXT_VIEW_FACING
    marker.text = f'{person_id}'
    marker.scale.z = TEXT_HEIGHT_M
    marker.color = TEXT
    # Up is -y in the optical frame.
    above = body.joints[JOINT_INDEX['head']] - [0.0, ABOVE_HEAD_M, 0.0]
    marker.pose.position = _point(above)
    return marker


def _marker(name: str, person_id: int, header: Header, action: int = Marker.ADD) -> Marker:
    marker = Marker(header=header, ns=name, id=person_id, action=action)
    marker.pose.orientation.w = 1.0
    return marker


def _point(p: np.ndarray) -> Point:
    return Point(x=float(p[0]), y=float(p[1]), z=float(p[2]))
