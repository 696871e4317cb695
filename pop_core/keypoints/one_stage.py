"""What networks that give whole people in one pass have in common: rows of boxes and keypoints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.keypoints.boxes import PersonBox, suppressed
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.keypoint_sets import COCO_17, shared_joints
from pop_core.keypoints.letterbox import Letterbox
from pop_core.keypoints.people import detection_of

MIN_SCORE = 0.25
SAME_BOX = 0.65  # people behind each other overlap by more than half
MOST_ROWS = 300  # rows compared with each other; the best ones


@dataclass(frozen=True, slots=True, eq=False)
class PeopleRows:
    """People of one image in pixels of the network's input.

    Args:
        boxes_px: Left, top, right, bottom of each.
        scores: Confidence 0..1 of each person.
        keypoints: Columns u, v [px] and confidence 0..1 of COCO's 17 keypoints.
    """

    boxes_px: Float[np.ndarray, 'n 4']
    scores: Float[np.ndarray, 'n']
    keypoints: Float[np.ndarray, 'n 17 3']


def people_of(rows: PeopleRows, placed: Letterbox) -> list[Detection]:
    """Return the people, best first, each once, in pixels of the image."""
    detections = []
    for i in best_rows(rows.boxes_px, rows.scores):
        uv = placed.to_image(rows.keypoints[i, :, :2])
        keypoints_px, scores = shared_joints(COCO_17, uv, rows.keypoints[i, :, 2])
        if not scores.any():
            continue
        box_px = placed.to_image(rows.boxes_px[i].reshape(2, 2)).ravel()
        detections.append(replace(detection_of(keypoints_px, scores), box_px=box_px))
    return detections


def person_boxes(
    boxes_px: Float[np.ndarray, 'n 4'], scores: Float[np.ndarray, 'n'], placed: Letterbox
) -> list[PersonBox]:
    """Return the boxes of people, best first, each once, in pixels of the image."""
    return [
        PersonBox(placed.to_image(boxes_px[i].reshape(2, 2)).ravel(), min(1.0, float(scores[i])))
        for i in best_rows(boxes_px, scores)]


def best_rows(
    boxes_px: Float[np.ndarray, 'n 4'], scores: Float[np.ndarray, 'n']
) -> list[int]:
    """Return the rows of people, best first: sure enough, of finite size, each once."""
    good: Bool[np.ndarray, 'n'] = np.isfinite(boxes_px).all(axis=1) & np.isfinite(scores)
    good &= np.nan_to_num(scores) >= MIN_SCORE
    rows = np.flatnonzero(good)
    rows = rows[np.argsort(-scores[rows], kind='stable')][:MOST_ROWS]
    return [int(rows[i]) for i in suppressed(boxes_px[rows], scores[rows], SAME_BOX)]


def corners_of(centred: Float[np.ndarray, 'n 4']) -> Float[np.ndarray, 'n 4']:
    """Return left, top, right, bottom of boxes given as centre, width and height."""
    half = 0.5 * centred[:, 2:]
    with np.errstate(invalid='ignore'):
        return np.concatenate([centred[:, :2] - half, centred[:, :2] + half], axis=1)
