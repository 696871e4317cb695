"""Boxes around people in pixels of the image: overlap and non-maximum suppression."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from pop_core.keypoints.detection import Detection
from pop_core.rgbd import RgbdFrame

SAME_PERSON = 0.6  # overlap of two boxes of one person; people side by side stay below


@dataclass(frozen=True, slots=True, eq=False)
class PersonBox:
    """Where a person is.

    Args:
        box_px: Left, top, right, bottom.
        score: Confidence 0..1.
    """

    box_px: Float[np.ndarray, '4']
    score: float


@runtime_checkable
class BoxDetector(Protocol):
    """Anything that finds where people are, without their joints."""

    def find_boxes(self, frame: RgbdFrame) -> list[PersonBox]:
        """Return a box around every person, best first."""
        ...


@runtime_checkable
class TopDownDetector(Protocol):
    """Anything that finds the joints of people whose boxes are known."""

    def detect_in(self, frame: RgbdFrame, boxes: Sequence[PersonBox]) -> list[Detection]:
        """Return the people of a frame's boxes, best first."""
        ...


def overlaps(
    a: Float[np.ndarray, 'n 4'], b: Float[np.ndarray, 'm 4']
) -> Float[np.ndarray, 'n m']:
    """Return the intersection over union of every box of a with every box of b."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = np.clip(high - low, 0.0, None).prod(axis=-1)
    union = box_areas(a)[:, None] + box_areas(b)[None] - shared
    return shared / np.maximum(union, 1e-9)


def box_areas(boxes: Float[np.ndarray, 'n 4']) -> Float[np.ndarray, 'n']:
    """Return the areas of boxes [px^2]; turned-around ones have none."""
    return np.clip(boxes[:, 2:] - boxes[:, :2], 0.0, None).prod(axis=1)


def suppressed(
    boxes: Float[np.ndarray, 'n 4'], scores: Float[np.ndarray, 'n'], same: float
) -> list[int]:
    """Return the rows that remain, best first: none overlaps a better one by more than `same`."""
    kept: list[int] = []
    order = [int(i) for i in np.argsort(-scores, kind='stable')]
    overlap = overlaps(boxes, boxes)
    for i in order:
        if not any(overlap[i, k] > same for k in kept):
            kept.append(i)
    return kept


def distinct_boxes(boxes: Sequence[PersonBox]) -> list[PersonBox]:
    """Return the boxes of several sources, each person once, best first."""
    if not boxes:
        return []
    stacked = np.stack([box.box_px for box in boxes])
    scores = np.array([box.score for box in boxes])
    return [boxes[i] for i in suppressed(stacked, scores, SAME_PERSON)]


def boxes_of(detections: Sequence[Detection]) -> list[PersonBox]:
    """Return the boxes of people whose keypoints are known."""
    return [PersonBox(person.box_px, person.score) for person in detections]
