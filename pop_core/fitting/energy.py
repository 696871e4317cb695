"""The energy of one person: every term of the fit, gathered for one step of the solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.levenberg_marquardt import Term
from pop_core.fitting.observation import Observation
from pop_core.fitting.priors import (
    conditional_prior_term,
    limit_prior_term,
    pose_prior_term,
    scale_weight,
    shape_prior_term,
)
from pop_core.fitting.residuals import (
    Pairs,
    expected_residual,
    expected_weight,
    joint_residual,
    joint_weight,
    pair_residual,
    ray_residual,
    ray_weight,
)
from pop_core.fitting.robust_loss import Power
from pop_core.fitting.self_collision import collision_residual
from pop_core.retrieval.pose_prior import PosePrior

# Which of `BodyEnergy.terms` say what; those after the priors are pairs of E_NN.
JOINT_BLOCKS = slice(0, 2)
PRIOR_BLOCKS = slice(3, 8)  # before them, where the joints are expected
PAIR_BLOCKS = slice(8, None)

@dataclass(frozen=True, slots=True, eq=False)
class PriorBelief:
    """What is believed of the pose before the surface is looked at.

    Args:
        prior: Pose prior learned from motion capture.
        pose: Retrieved pose of this hypothesis [rad].
        sigma_rad: Spread of the retrieved neighbours per joint [rad].
    """

    prior: PosePrior
    pose: Float[np.ndarray, '23 3']
    sigma_rad: Float[np.ndarray, '23']


@dataclass(frozen=True, slots=True)
class TermWeights:
    """Multipliers of the terms in one part of the schedule.

    Args:
        joints: Of E_J3D.
        prior: Of the pose prior.
        neighbours: Of the conditional prior.
        collision: Of limbs inside the trunk or each other.
        expected: Of the joints that are expected from depth and keypoints.
        robust_m: Scale of the robust kernel of E_J3D [m].
    """

    joints: float = 1.0
    prior: float = 1.0
    neighbours: float = 1.0
    collision: float = 0.0
    expected: float = 0.0
    robust_m: float = 0.15


class BodyEnergy:
    """All terms with their robust weights and pairs held constant, as one step needs them."""

    def __init__(
        self,
        state: BodyState,
        observation: Observation,
        belief: PriorBelief,
        weights: TermWeights,
        pairs: Pairs | None = None,
        *,
        power: Power = Power.STEP,
    ) -> None:
        """Freeze robust weights at `state`: those of a step, or those bodies are compared by."""
        self.observation, self.belief, self.weights, self.pairs = (
            observation, belief, weights, pairs)
        lifted, rays = observation.lifted, observation.keypoint_rays
        self.joint_weight = weights.joints * joint_weight(
            state, lifted, weights.robust_m, power)
        self.ray_weight = weights.joints * ray_weight(state, rays, power)
        self.expected_weight = weights.expected * expected_weight(
            state, observation.expected, power)
        self.scale_weight = scale_weight(state, power)

    def terms(self, state: BodyState, jacobian: bool) -> list[Term]:
        """Return every term at a state."""
        lifted, rays = self.observation.lifted, self.observation.keypoint_rays
        belief, weights = self.belief, self.weights
        blocks: list[Term] = [
            joint_residual(state, lifted, self.joint_weight, jacobian=jacobian),
            ray_residual(state, rays, self.ray_weight, jacobian=jacobian),
            expected_residual(
                state, self.observation.expected, self.expected_weight, jacobian=jacobian),
            pose_prior_term(state, belief.prior, weights.prior, jacobian=jacobian),
            conditional_prior_term(
                state, belief.pose, belief.sigma_rad, weights.neighbours, jacobian=jacobian),
            limit_prior_term(state, jacobian=jacobian),
            shape_prior_term(state, self.scale_weight),
            collision_residual(state, weights.collision, jacobian=jacobian),
        ]
        if self.pairs is not None and len(self.pairs.vertex):
            blocks.append(pair_residual(state, self.pairs, jacobian=jacobian))
        return blocks
