"""People as zed_msgs/ObjectsStamped with skeletons in ZED's format BODY_38.

BODY_38 has SMPL's spine, collars and limbs by the same names, and points of face, feet and hands.
The head joint and the ball joints of the feet have no place in it; small toes and fingers have no
counterpart here and are marked as ZED marks points it has not found.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from std_msgs.msg import Header

from pop_core.estimate import Track, TrackState
from pop_ros.interop_person import POINT_INDEX, Person, box_px

POSE_38 = 2  # zed_msgs/Object.body_format
SLOTS = 70  # keypoints a message has room for, in whatever format
# The points of BODY_38 in its order; '' has no counterpart.
BODY_38 = (
    'pelvis', 'spine1', 'spine2', 'spine3', 'neck', 'nose', 'left_eye', 'right_eye', 'left_ear',
    'right_ear', 'left_collar', 'right_collar', 'left_shoulder', 'right_shoulder', 'left_elbow',
    'right_elbow', 'left_wrist', 'right_wrist', 'left_hip', 'right_hip', 'left_knee',
    'right_knee', 'left_ankle', 'right_ankle', 'left_big_toe', 'right_big_toe', '', '',
    'left_heel', 'right_heel', *[''] * 8,
)
FILLED = [(slot, POINT_INDEX[name]) for slot, name in enumerate(BODY_38) if name]
# ZED's words for the life of a track; 0 is off and 3 the last one.
OK, SEARCHING = 1, 2
TRACKING = {TrackState.NEW: OK, TrackState.TRACKED: OK, TrackState.PREDICTED: SEARCHING,
            TrackState.LOST: SEARCHING}
NO_PIXEL = -1.0  # of a point outside the image
LABELS = 2**15  # label_id is an int16
HEAD_RADIUS_M = 0.14
UPPER_TRIANGLE = np.triu_indices(3)
# Corners of a box in ZED's order: around the top, then around the bottom. Up is -y.
AROUND = ((0, 0), (0, 1), (1, 1), (1, 0))  # (right, far)
CORNERS = [(right, bottom, far) for bottom in (0, 1) for right, far in AROUND]


def objects_message(people: Sequence[Person], header: Header, zed_msgs: Any) -> Any:
    """Return an ObjectsStamped in the frame of the header."""
    return zed_msgs.ObjectsStamped(header=header, objects=[_object(p, zed_msgs) for p in people])


def _object(person: Person, zed_msgs: Any) -> Any:
    body, track = person.body, person.body.track
    message = zed_msgs.Object(
        label=f'Body_{person.id}', label_id=person.id % LABELS,
        confidence=float(np.clip(100 * body.score, 1, 99)),
        position=body.joints[0].astype(np.float32),
        position_covariance=body.joint_covariance[0][UPPER_TRIANGLE].astype(np.float32),
        tracking_available=track is not None, tracking_state=_tracking_state(track),
        dimensions_3d=np.ptp(person.box_m, axis=0).astype(np.float32),
        skeleton_available=True, body_format=POSE_38)
    _fill_corners(message.bounding_box_3d, person.box_m)
    _fill_rectangle(message.bounding_box_2d, person.box_px, np.uint32)
    _fill_head(message, person)
    _fill_skeleton(message, person)
    return message


def _tracking_state(track: Track | None) -> int:
    return OK if track is None else TRACKING[track.state]


def _fill_corners(box: Any, limits_m: Float[np.ndarray, '2 3']) -> None:
    for corner, ends in zip(box.corners, CORNERS, strict=True):
        corner.kp = limits_m[ends, range(3)].astype(np.float32)


def _fill_rectangle(
    box: Any, limits_px: Float[np.ndarray, '4'] | None, kind: type[np.generic]
) -> None:
    """Fill in the corners of a box: top left, then clockwise; zeros where there is none."""
    if limits_px is None:
        return
    left, top, right, bottom = np.rint(limits_px)
    places = ((left, top), (right, top), (right, bottom), (left, bottom))
    for corner, place in zip(box.corners, places, strict=True):
        corner.kp = np.array(place, kind)


def _fill_head(message: Any, person: Person) -> None:
    """Fill in a cube around the middle of the head, and its rectangle in the image."""
    middle = person.p_camera[person.rows(['left_ear', 'right_ear'])].mean(axis=0)
    limits_m = np.array([middle - HEAD_RADIUS_M, middle + HEAD_RADIUS_M])
    message.head_position = middle.astype(np.float32)
    _fill_corners(message.head_bounding_box_3d, limits_m)
    corners = np.array([limits_m[ends, range(3)] for ends in CORNERS])
    _fill_rectangle(message.head_bounding_box_2d, box_px(corners, person.camera), np.float32)


def _fill_skeleton(message: Any, person: Person) -> None:
    points = np.full((SLOTS, 3), np.nan, np.float32)
    pixels = np.full((SLOTS, 2), NO_PIXEL, np.float32)
    confidence = np.full(SLOTS, np.nan, np.float32)
    for slot, row in FILLED:
        points[slot] = person.p_camera[row]
        confidence[slot] = 100 * person.confidence[row]
        if person.in_image[row]:
            pixels[slot] = person.uv[row]
    for slot in range(SLOTS):
        message.skeleton_3d.keypoints[slot].kp = points[slot]
        message.skeleton_2d.keypoints[slot].kp = pixels[slot]
    if hasattr(message, 'skeleton_keypoint_confidence'):  # zed_msgs 4.2.5 and later
        message.skeleton_keypoint_confidence = confidence
