"""Left and right of keypoints, by the body that is followed: detectors take one for the other.

Whoever is followed has not turned round since the last frame. Keypoints that agree only once
their sides are exchanged are taken so, for arms and legs apart, and raise a doubt: it may be the
body that is the wrong way round. Then they say nothing of which of two bodies is right.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import N_SHARED, SHARED_MIRROR, SHARED_NAMES
from pop_core.fitting.observation import Observation
from pop_core.keypoints.lifted_joints import LiftedJoints

FAR_M = 0.15  # a joint farther off than this is no worse still
GAIN = 1.5  # joints' worth of agreement that exchanged sides must bring
ARM, LEG = ('shoulder', 'elbow', 'wrist'), ('hip', 'knee', 'ankle')
PAIRS = np.array([[name.split('_')[-1] in kind for name in SHARED_NAMES] for kind in (ARM, LEG)])


def misnamed_joints(
    landmarks: Float[np.ndarray, 's 3'], lifted: LiftedJoints
) -> Bool[np.ndarray, 's']:
    """Return the joints of arms or legs that agree with a body only with sides exchanged.

    Args:
        landmarks: The 15 shared points of the predicted body [m].
        lifted: The joints that were detected.
    """
    as_named = _disagreement(landmarks, lifted)
    exchanged = _disagreement(landmarks[SHARED_MIRROR], lifted)
    out = np.zeros(N_SHARED, dtype=bool)
    for pair in PAIRS:
        before, after = as_named[pair].sum(), exchanged[pair].sum()
        if before - after > GAIN and after < before / 2:
            out |= pair
    return out


def without_joints(observation: Observation, joints: Bool[np.ndarray, 's']) -> Observation:
    """Return an observation in which some joints were not detected."""
    rays = observation.keypoint_rays
    keep = ~joints[rays.joint]
    return replace(observation, lifted=observation.lifted.without(joints), keypoint_rays=replace(
        rays, joint=rays.joint[keep], across=rays.across[keep], score=rays.score[keep]))


def _disagreement(
    landmarks: Float[np.ndarray, 's 3'], lifted: LiftedJoints
) -> Float[np.ndarray, 's']:
    """Return how little each joint agrees, 0 to its score; 0 for those that were not lifted."""
    off_m = np.linalg.norm(landmarks - lifted.positions_camera, axis=1)
    worst = np.minimum(np.where(lifted.lifted, off_m, 0.0) / FAR_M, 1.0) ** 2
    return np.where(lifted.lifted, lifted.scores, 0.0) * worst
