"""The energy of a tracked body: what the sensor says, priors, and the predicted body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.energy import (
    JOINT_BLOCKS,
    PAIR_BLOCKS,
    PRIOR_BLOCKS,
    BodyEnergy,
    PriorBelief,
    TermWeights,
)
from pop_core.fitting.levenberg_marquardt import Quadratic, Residual, Term, assemble
from pop_core.fitting.observation import Observation
from pop_core.fitting.priors import limit_prior_term, pose_prior_term
from pop_core.fitting.robust_loss import geman_mcclure_weight
from pop_core.geometry.block_kernels import sandwich
from pop_core.geometry.rotation import left_jacobian_inverse
from pop_core.retrieval.pose_prior import PosePrior
from pop_core.tracking.body_filter import FilterState, difference, inverse
from pop_core.tracking.measured_surface import SurfaceTerms
from pop_core.tracking.motion import N_MOVING

TURNS = slice(3, N_MOVING)  # the increments of rotations
SURE_SIGMAS = 2.0  # a joint may be found this far from its prediction, and be the joint


class Prediction:
    """A predicted body as a term: squared distance by the filter's covariance."""

    def __init__(self, predicted: FilterState, body: BodyState) -> None:
        """Invert the covariance of a predicted state.

        Args:
            predicted: The belief before the frame was looked at.
            body: The predicted body.
        """
        self.parameters = predicted.parameters
        self.information = inverse(predicted.covariance)
        J = body.landmark_jacobian
        variance = np.einsum('sax,sax->s', J @ predicted.covariance, J) / 3.0
        self.landmark_sigma_m = np.sqrt(variance)

    def term(self, state: BodyState, *, jacobian: bool) -> Quadratic:
        """Return 1/2 (x - predicted)' information (x - predicted)."""
        step = difference(state.parameters, self.parameters)
        pull = self.information @ step
        cost = 0.5 * float(step @ pull)
        if not jacobian:
            return Quadratic(cost)
        # d(difference)/d(increment) is the unit matrix but where rotations turn.
        turn = left_jacobian_inverse(step[TURNS].reshape(-1, 3))
        hessian = sandwich(self.information, turn, TURNS.start)
        pull[TURNS] = np.einsum('jab,ja->jb', turn, pull[TURNS].reshape(-1, 3)).reshape(-1)
        return Quadratic(cost, pull, np.asarray(hessian))


@dataclass(frozen=True, slots=True, eq=False)
class Curvature:
    """J'WJ at a fit, split by where it comes from.

    Args:
        data: What was measured in this frame.
        prior: What is believed of any body: plausible poses, limits, shape.
    """

    data: Float[np.ndarray, 'x x']
    prior: Float[np.ndarray, 'x x']


class TrackedEnergy:
    """Terms of one body in one step: measured, believed of bodies, believed of this body."""

    def __init__(
        self, state: BodyState, observation: Observation, prior: PosePrior,
        weights: TermWeights, surface: SurfaceTerms, prediction: Prediction,
    ) -> None:
        """Freeze robust weights at `state`."""
        # The predicted body takes the place of the retrieved pose.
        belief = PriorBelief(prior, state.parameters.body_pose, np.ones(23))
        self._energy = BodyEnergy(state, observation, belief, weights, surface.pairs)
        self._energy.joint_weight = _joint_weight(state, observation, weights, prediction)
        self._prediction, self._n_measured = prediction, surface.n_measured

    def terms(self, state: BodyState, jacobian: bool) -> list[Term]:
        """Return every term at a state."""
        return [
            *self._energy.terms(state, jacobian),
            self._prediction.term(state, jacobian=jacobian)]

    def curvature(self, state: BodyState) -> tuple[Curvature, list[Term]]:
        """Return what bends the energy at a state, and the terms it was made of."""
        blocks = self._energy.terms(state, True)
        size = state.body.size
        measured = [
            block.first(self._n_measured) for block in blocks[PAIR_BLOCKS]
            if isinstance(block, Residual)]
        return Curvature(
            assemble([*blocks[JOINT_BLOCKS], *measured], size).hessian,
            assemble(blocks[PRIOR_BLOCKS], size).hessian), blocks


def prior_curvature(
    state: BodyState, prior: PosePrior, weight: float
) -> Float[np.ndarray, 'x x']:
    """Return J'WJ of what is believed of any pose."""
    blocks: list[Term] = [
        pose_prior_term(state, prior, weight, jacobian=True),
        limit_prior_term(state, jacobian=True)]
    return assemble(blocks, state.body.size).hessian


def _joint_weight(
    state: BodyState, observation: Observation, weights: TermWeights, prediction: Prediction
) -> Float[np.ndarray, 's']:
    """Return the robust weight 1/sigma^2 of every lifted joint, zero for the others.

    The scale of the kernel grows with the doubt of the prediction: a limb that may be anywhere by
    now listens to keypoints that are far away, one that was just seen does not.
    """
    lifted = observation.lifted
    offset = np.where(
        lifted.lifted[:, None], state.landmarks - lifted.positions_camera, 0.0)
    scale_m = np.hypot(weights.robust_m, SURE_SIGMAS * prediction.landmark_sigma_m)
    robust = geman_mcclure_weight(np.linalg.norm(offset, axis=1) / scale_m, 1.0)
    return np.where(lifted.lifted, weights.joints * robust / lifted.sigma_m**2, 0.0)
