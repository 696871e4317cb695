"""People as yolo_msgs/DetectionArray: COCO's 17 keypoints in 2D and 3D, boxes and outline."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from geometry_msgs.msg import Point
from jaxtyping import Bool
from std_msgs.msg import Header

from pop_core.body.joints import COCO_17_NAMES
from pop_ros.interop_person import Person
from pop_ros.interop_vision import PERSON, box_fields

PERSON_CLASS = 0  # of COCO's 80
FIRST_KEYPOINT = 1  # yolo_ros counts keypoints from one


def detections_message(people: Sequence[Person], header: Header, yolo_msgs: Any) -> Any:
    """Return a DetectionArray of the people who are in the image at least in part."""
    return yolo_msgs.DetectionArray(header=header, detections=[
        _detection(p, header.frame_id, yolo_msgs) for p in people if p.box_px is not None])


def _detection(person: Person, frame_id: str, yolo_msgs: Any) -> Any:
    return yolo_msgs.Detection(
        class_id=PERSON_CLASS, class_name=PERSON, score=float(person.body.score),
        id=f'{person.id}', bbox=_box(person, yolo_msgs),
        bbox3d=yolo_msgs.BoundingBox3D(**box_fields(person), frame_id=frame_id),
        mask=_outline(person.body.mask, yolo_msgs),
        keypoints=yolo_msgs.KeyPoint2DArray(data=_keypoints_2d(person, yolo_msgs)),
        keypoints3d=yolo_msgs.KeyPoint3DArray(
            data=_keypoints_3d(person, yolo_msgs), frame_id=frame_id))


def _box(person: Person, yolo_msgs: Any) -> Any:
    assert person.box_px is not None
    left, top, right, bottom = person.box_px.tolist()
    box = yolo_msgs.BoundingBox2D()
    box.center.position.x, box.center.position.y = (left + right) / 2, (top + bottom) / 2
    box.size.x, box.size.y = right - left, bottom - top
    return box


def _outline(mask: Bool[np.ndarray, 'h w'], yolo_msgs: Any) -> Any:
    """Return the boundary of the largest part of a mask."""
    contours, _ = cv2.findContours(
        mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    largest = max(contours, key=cv2.contourArea, default=np.zeros((0, 1, 2)))
    return yolo_msgs.Mask(
        height=mask.shape[0], width=mask.shape[1],
        data=[yolo_msgs.Point2D(x=float(u), y=float(v)) for u, v in largest[:, 0]])


def _keypoints_2d(person: Person, yolo_msgs: Any) -> list[Any]:
    """Return the keypoints that fall into the image."""
    found = []
    for number, row in enumerate(person.rows(COCO_17_NAMES), FIRST_KEYPOINT):
        if person.in_image[row]:
            u, v = person.uv[row].tolist()
            found.append(yolo_msgs.KeyPoint2D(
                id=number, point=yolo_msgs.Point2D(x=u, y=v),
                score=float(person.confidence[row])))
    return found


def _keypoints_3d(person: Person, yolo_msgs: Any) -> list[Any]:
    found = []
    for number, row in enumerate(person.rows(COCO_17_NAMES), FIRST_KEYPOINT):
        x, y, z = person.p_camera[row].tolist()
        found.append(yolo_msgs.KeyPoint3D(
            id=number, point=Point(x=x, y=y, z=z), score=float(person.confidence[row])))
    return found
