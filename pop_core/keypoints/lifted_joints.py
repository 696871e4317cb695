"""Keypoints with depth: the input of retrieval and of the joint term of the fit."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import SHARED_MIRROR


class LiftState(IntEnum):
    """What became of a keypoint when it was lifted."""

    VISIBLE = 0
    OCCLUDED = 1
    OUTLIER = 2
    MISSING = 3
    GUESSED = 4  # by the detector: the position is that of what hides the joint, or of the joint


@dataclass(frozen=True, slots=True, eq=False)
class LiftedJoints:
    """The shared joints of one person in 3D.

    Args:
        positions_camera: Joint centres (not skin) in the camera frame [m]; NaN unless lifted.
        sigma_m: Standard deviation of each position [m]; inf unless lifted.
        state: A LiftState per joint.
        keypoints_px: The pixels they came from; kept for occluded joints too, whose direction
            is known although their depth is not. NaN where nothing was detected.
        scores: Detector confidence 0..1 of each keypoint.
    """

    positions_camera: Float[np.ndarray, 's 3']
    sigma_m: Float[np.ndarray, 's']
    state: Int[np.ndarray, 's']
    keypoints_px: Float[np.ndarray, 's 2']
    scores: Float[np.ndarray, 's']

    @property
    def distance_m(self) -> float:
        """Return the median depth of the lifted joints [m]; inf when there are none."""
        z = self.positions_camera[self.lifted, 2]
        return float(np.median(z)) if len(z) else float('inf')

    @property
    def extent_m(self) -> float:
        """Return the longest side of the box around the lifted joints [m]; 0 without joints."""
        seen = self.positions_camera[self.lifted]
        return float(np.ptp(seen, axis=0).max()) if len(seen) else 0.0

    @property
    def lifted(self) -> Bool[np.ndarray, 's']:
        """Return which joints have a position."""
        return np.isfinite(self.positions_camera).all(axis=1)

    def without_guesses(self) -> LiftedJoints:
        """Return the joints with guessed ones known by their pixel alone."""
        guessed = self.state == LiftState.GUESSED
        return LiftedJoints(
            np.where(guessed[:, None], np.nan, self.positions_camera),
            np.where(guessed, np.inf, self.sigma_m),
            np.where(guessed, int(LiftState.OCCLUDED), self.state),
            self.keypoints_px, self.scores)

    def with_sides_exchanged(self) -> LiftedJoints:
        """Return the joints with every left one called right, and the other way round."""
        return LiftedJoints(
            self.positions_camera[SHARED_MIRROR], self.sigma_m[SHARED_MIRROR],
            self.state[SHARED_MIRROR], self.keypoints_px[SHARED_MIRROR],
            self.scores[SHARED_MIRROR])
