"""Keypoints with depth: the input of retrieval and of the joint term of the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import N_SHARED, SHARED_MIRROR

SURE_SCORE = 0.55
EVERY_JOINT = np.ones(N_SHARED, dtype=bool)


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

    @property
    def sure(self) -> Bool[np.ndarray, 's']:
        """Return which joints were lifted from keypoints that the detector is sure of."""
        return self.lifted & (self.scores >= SURE_SCORE)

    def without_guesses(self) -> LiftedJoints:
        """Return the joints with guessed ones known by their pixel alone."""
        return self._unlifted(self.state == LiftState.GUESSED, LiftState.OCCLUDED)

    def without(self, joints: Bool[np.ndarray, 's']) -> LiftedJoints:
        """Return the joints as if some had not been detected."""
        return replace(
            self._unlifted(joints, LiftState.MISSING),
            keypoints_px=np.where(joints[:, None], np.nan, self.keypoints_px),
            scores=np.where(joints, 0.0, self.scores))

    def _unlifted(self, joints: Bool[np.ndarray, 's'], state: LiftState) -> LiftedJoints:
        return replace(
            self,
            positions_camera=np.where(joints[:, None], np.nan, self.positions_camera),
            sigma_m=np.where(joints, np.inf, self.sigma_m),
            state=np.where(joints, int(state), self.state))

    def with_sides_exchanged(
        self, joints: Bool[np.ndarray, 's'] = EVERY_JOINT
    ) -> LiftedJoints:
        """Return the joints with every left one, or some, called right, and the other way round.

        Args:
            joints: Which; both of a pair or none.
        """
        source = np.where(joints, SHARED_MIRROR, np.arange(N_SHARED))
        return LiftedJoints(
            self.positions_camera[source], self.sigma_m[source], self.state[source],
            self.keypoints_px[source], self.scores[source])
