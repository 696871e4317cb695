"""A lost limb is looked for: the plausible one nearest to its keypoints, moved onto them.

The surface cannot carry an arm round the trunk to where it is seen, and a few steps from the
wrong side end nowhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import SHARED
from pop_core.body.model import BodyParameters
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.energy import BodyEnergy, PriorBelief, TermWeights
from pop_core.fitting.levenberg_marquardt import FIRST_DAMPING, levenberg_marquardt_step
from pop_core.fitting.observation import Observation
from pop_core.retrieval.pose_prior import PosePrior

N_POSES = 48  # drawn from the prior once: four limbs of each are tried
STEPS = 4
WIDE_M = 0.3  # scale of the robust kernel: limbs are far from their keypoints at first
NEAR_M = 0.1


class LimbSearch:
    """Plausible limbs to begin with."""

    def __init__(self, prior: PosePrior) -> None:
        """Draw poses from a prior: the same ones every time."""
        self.prior = prior
        self.poses = prior.sample(np.random.default_rng(0), N_POSES)

    def find(
        self, state: BodyState, observation: Observation, loose: Bool[np.ndarray, '24']
    ) -> BodyParameters:
        """Return a body whose loose joints follow keypoints and the prior alone.

        Args:
            state: Where the rest of the body is.
            observation: What the sensor says; only its keypoints are used.
            loose: Joints that turn.
        """
        trials = [state, *(self._with_limb(state, pose, loose) for pose in self.poses)]
        body = min(trials, key=lambda trial: _keypoint_cost(trial, observation, loose))
        belief = PriorBelief(self.prior, body.parameters.body_pose, np.ones(23))
        weights = TermWeights(neighbours=0.0, robust_m=WIDE_M)
        active = np.zeros(body.body.size, dtype=bool)
        active[3: 3 + 3 * len(loose)] = np.repeat(loose, 3)
        damping = FIRST_DAMPING
        for _ in range(STEPS):
            energy = BodyEnergy(body, observation, belief, weights)
            report = levenberg_marquardt_step(
                body, energy.terms, BodyState.moved, active, damping)
            body, damping = report.state, report.damping
        return body.parameters

    @staticmethod
    def _with_limb(
        state: BodyState, pose: Float[np.ndarray, '23 3'], loose: Bool[np.ndarray, '24']
    ) -> BodyState:
        own = state.parameters
        return state.body.state(replace(
            own, body_pose=np.where(loose[1:, None], pose, own.body_pose)))


def _keypoint_cost(
    state: BodyState, observation: Observation, loose: Bool[np.ndarray, '24']
) -> float:
    """Return how far the loose joints lie from keypoints and their rays, in units of NEAR_M."""
    lifted, rays = observation.lifted, observation.keypoint_rays
    own = loose[SHARED]
    near = lifted.lifted & own
    offset = state.landmarks[near] - lifted.positions_camera[near]
    guessed = own[rays.joint]
    across = np.einsum('nkc,nc->nk', rays.across[guessed], state.landmarks[rays.joint[guessed]])
    squared = np.square(offset).sum() + rays.score[guessed] @ np.square(across).sum(axis=1)
    return float(squared + _in_the_open(state, observation, loose)) / NEAR_M**2


def _in_the_open(
    state: BodyState, observation: Observation, loose: Bool[np.ndarray, '24']
) -> float:
    """Return the sum of squares of how far the loose joints stand before what is measured [m^2].

    Nobody knows where a hidden limb is; but not where the camera saw through it.
    """
    joints = state.joints[loose]
    gap_m = observation.depth_at(joints)[0] - joints[:, 2]
    # Nothing is known of what lies outside the window.
    open_m = np.where(np.isfinite(gap_m), np.clip(gap_m, 0.0, WIDE_M), 0.0)
    return float(np.square(open_m).sum())
