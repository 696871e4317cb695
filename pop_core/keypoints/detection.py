"""What a keypoint source says about one person in one image, and the protocol of all sources."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int, Int8

from pop_core.body.joints import N_SHARED, SHARED_MIRROR
from pop_core.errors import DetectionError
from pop_core.keypoints.body_parts import LABEL_MIRROR
from pop_core.rgbd import RgbdFrame

SHAPES = {
    'keypoints_px': (N_SHARED, 2), 'scores': (N_SHARED,), 'box_px': (4,),
    'joint_depth_m': (N_SHARED,), 'joint_sigma_m': (N_SHARED,), 'visible': (N_SHARED,)}


@dataclass(frozen=True, slots=True, eq=False)
class Detection:
    """One person in one image.

    Args:
        keypoints_px: Pixels (u, v) of the 15 shared joints; NaN where not detected.
        scores: Confidence 0..1 of each; 0 where not detected.
        box_px: Bounding box (left, top, right, bottom) of the person.
        joint_depth_m: Metric depth of each joint itself (not of the skin), NaN where unknown;
            None from sources that see no depth.
        joint_sigma_m: Standard deviation of `joint_depth_m` [m].
        visible: Probability that each joint is seen, not hidden; None when the source cannot say.
        person_mask: Pixels of this person, or None.
        part_labels: Joint index (0..23) of the body part at each pixel, -1 elsewhere, or None.
        sees_colour: Whether keypoints come from colour and are exact to some pixels; beside such
            sources one that sees depth alone, and knows limbs to some centimetres, stands back.

    Raises:
        DetectionError: If an array has not one row for each of the 15 shared joints.
    """

    keypoints_px: Float[np.ndarray, 's 2']
    scores: Float[np.ndarray, 's']
    box_px: Float[np.ndarray, '4']
    joint_depth_m: Float[np.ndarray, 's'] | None = None
    joint_sigma_m: Float[np.ndarray, 's'] | None = None
    visible: Float[np.ndarray, 's'] | None = None
    person_mask: Bool[np.ndarray, 'h w'] | None = None
    part_labels: Int8[np.ndarray, 'h w'] | None = None
    sees_colour: bool = True

    def __post_init__(self) -> None:
        for name, shape in SHAPES.items():
            values = getattr(self, name)
            if values is not None and np.shape(values) != shape:
                raise DetectionError(
                    f'detection: expected {name} of shape {shape}, for the {N_SHARED} joints of '
                    f'pop_core.body.joints.SHARED_NAMES, found {np.shape(values)}: '
                    'pop_core.keypoints.people.detections_of converts keypoint sets')

    @property
    def score(self) -> float:
        """Return the mean confidence over the 15 shared joints, undetected ones counting zero."""
        return float(self.scores.mean())

    def with_sides_exchanged(self) -> Detection:
        """Return the detection with every left joint and part called right, and vice versa."""
        return replace(
            self, keypoints_px=self.keypoints_px[SHARED_MIRROR],
            scores=self.scores[SHARED_MIRROR],
            joint_depth_m=_taken(self.joint_depth_m, SHARED_MIRROR),
            joint_sigma_m=_taken(self.joint_sigma_m, SHARED_MIRROR),
            visible=_taken(self.visible, SHARED_MIRROR),
            part_labels=None if self.part_labels is None else LABEL_MIRROR[self.part_labels])


def _taken(
    values: Float[np.ndarray, 's'] | None, order: Int[np.ndarray, 's']
) -> Float[np.ndarray, 's'] | None:
    return None if values is None else values[order]


@runtime_checkable  # so that tests can check arguments of this type
class KeypointDetector(Protocol):
    """Anything that finds people in a frame (step 2: J_2D)."""

    def detect(self, frame: RgbdFrame) -> list[Detection]:
        """Return the people of a frame, best first; an empty list when there are none."""
        ...
