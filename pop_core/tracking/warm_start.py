"""A few steps of the fit from a predicted body (steps 6 to 8), with all visibility reasoning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.estimate import RunnerUp
from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.depth_consistency import (
    HidingPlaces,
    Sight,
    Visibility,
    depth_energy,
    see_body,
)
from pop_core.fitting.disagreement import disagreement
from pop_core.fitting.energy import PAIR_BLOCKS, PRIOR_BLOCKS, TermWeights
from pop_core.fitting.levenberg_marquardt import (
    FIRST_DAMPING,
    cost_of,
    levenberg_marquardt_step,
)
from pop_core.fitting.observation import Observation
from pop_core.tracking.body_filter import FilterState, update
from pop_core.tracking.limb_claims import LimbClaims
from pop_core.tracking.measured_surface import surface_terms
from pop_core.tracking.tracked_energy import Curvature, Prediction, TrackedEnergy

# The robust kernel from the first to the last step [m]: a prediction is off by little, unless
# keypoints say otherwise.
WIDE_M, WIDEST_M, NARROWEST_M = 0.07, 0.13, 0.03
SURPRISE_M = 0.12  # keypoints this far from a predicted body need a wide kernel and more steps
EXTRA_STEPS = 2
NOISE_SIGMAS = 1.0  # the kernel is never narrower than the sensor's noise
JOINTS_WEIGHT = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """How much of a body the camera sees where it is thought to be.

    Args:
        seen: Share of the vertices toward the camera that the measured surface agrees with.
        contradicted: Share of them that the camera saw through.
    """

    seen: float
    contradicted: float


def sighting(visibility: Visibility) -> Sighting:
    """Return how much of a body is seen, and how much of it cannot be there."""
    sight = visibility.sight[visibility.facing]
    count = max(len(sight), 1)
    return Sighting(
        float((sight == Sight.VISIBLE).sum() / count),
        float((sight == Sight.CONTRADICTED).sum() / count))


@dataclass(frozen=True, slots=True, eq=False)
class SeenBody:
    """A body and how the camera sees it.

    Args:
        state: The body on the coarse mesh.
        visibility: Sight of its vertices.
    """

    state: BodyState
    visibility: Visibility

    @classmethod
    def look(cls, state: BodyState, observation: Observation) -> SeenBody:
        """Return a body as an observation sees it."""
        return cls(state, see_body(state, observation))


@dataclass(frozen=True, slots=True, eq=False)
class FollowedBody(SeenBody):
    """A body, and what of an image is its own.

    Args:
        state: The body on the coarse mesh.
        visibility: Sight of the coarse mesh.
        segment: Pixels of the observation that show the person.
        of_limb: Weight of the measured points that each of `limb_claims.LIMBS` claims.
    """

    segment: Bool[np.ndarray, 'h w']
    of_limb: Float[np.ndarray, '4']


@dataclass(frozen=True, slots=True, eq=False)
class WarmFit(FollowedBody):
    """A body followed into a frame.

    Args:
        before: Inverse covariance of the belief it began with.
        curvature: J'WJ of measurements and priors.
        energies: Final energies by name.
    """

    before: Float[np.ndarray, 'x x']
    curvature: Curvature
    energies: dict[str, float]

    def as_body_fit(
        self, alternatives: Sequence[BodyState], unnamed: Bool[np.ndarray, '24']
    ) -> BodyFit:
        """Return the fit as one of a single frame, with the curvature of all that is known.

        Args:
            alternatives: Other explanations of the person.
            unnamed: Joints of limbs that no keypoint confirmed at the last look.
        """
        left = disagreement(
            self.state, alternatives, [0.0] * len(alternatives), (), unnamed)
        hessian = self.before + self.curvature.data + self.curvature.prior
        return BodyFit(
            self.state.parameters, hessian, self.visibility, self.state, self.segment,
            self.energies,
            tuple(RunnerUp(other.parameters, 0.0, finished=True) for other in alternatives), left)


def updated(predicted: FilterState, fit: WarmFit) -> FilterState:
    """Return the belief after a fit."""
    return update(predicted, fit.state.parameters, fit.before, fit.curvature.data)


class WarmStart:
    """Follows bodies of one model from predictions."""

    def __init__(self, fitter: BodyFitter, prior_weight: float) -> None:
        """Use the terms and settings of a fitter, and another weight of the pose prior."""
        self.fitter, self.prior_weight = fitter, prior_weight

    def fit(
        self, predicted: FilterState, observation: Observation, steps: int, *, detected: bool,
        loose: Bool[np.ndarray, '24'] | None = None, start: SeenBody | None = None,
    ) -> WarmFit:
        """Return the body after some steps from a prediction.

        Args:
            predicted: What is believed of the body in this frame: where the steps begin, and a
                residual in each of them.
            observation: What the sensor says.
            steps: How many steps.
            detected: Whether the observation holds keypoints of this frame.
            loose: Limbs that follow keypoints alone until the last steps.
            start: The predicted body as it is seen, where that is known already.
        """
        start = start or SeenBody.look(
            self.fitter.coarse.state(predicted.parameters), observation)
        state, visibility = start.state, start.visibility
        prediction = Prediction(predicted, state)
        weights = TermWeights(
            JOINTS_WEIGHT if detected else 0.0, self.prior_weight, 0.0)
        surprised = loose is not None or (
            detected and farthest_joint_m(state, observation) > SURPRISE_M)
        scales_m = np.hypot(
            np.geomspace(
                WIDEST_M if surprised else WIDE_M, NARROWEST_M, steps + EXTRA_STEPS * surprised),
            NOISE_SIGMAS * observation.noise.sigma_m(state.joints[:1, 2]))
        damping = FIRST_DAMPING
        active = np.ones(state.body.size, dtype=bool)
        segment = self.fitter.steps.segment(visibility.rendered, observation)
        places = HidingPlaces(observation, segment, state.vertices[:, 2])
        for k, scale_m in enumerate(scales_m):
            claims = LimbClaims(state, observation, prediction.landmark_sigma_m)
            surface = surface_terms(
                state, observation, visibility, segment, places=places, claims=claims,
                scale_m=float(scale_m), config=self.fitter.config)
            if loose is not None and k < EXTRA_STEPS:
                surface = surface.without(loose, state)
            energy = TrackedEnergy(
                state, observation, self.fitter.prior, weights, surface, prediction)
            report = levenberg_marquardt_step(
                state, energy.terms, BodyState.moved, active, damping)
            state, damping = report.state, report.damping
            visibility = see_body(state, observation)
            segment = self.fitter.steps.segment(visibility.rendered, observation)
        curvature, blocks = energy.curvature(state)
        energies = {
            'E_J3D': cost_of(blocks[:1]), 'E_prior': cost_of(blocks[PRIOR_BLOCKS]),
            'E_NN': cost_of(blocks[PAIR_BLOCKS]) + surface.spread,
            'E_depth': depth_energy(visibility.rendered.depth_m, observation, segment),
        }
        return WarmFit(
            state, visibility, segment, surface.of_limb, prediction.information, curvature,
            energies)


def farthest_joint_m(state: BodyState, observation: Observation) -> float:
    """Return how far the farthest lifted joint lies from the body's [m], weighed by its score."""
    lifted = observation.lifted
    rows = lifted.lifted
    if not rows.any():
        return 0.0
    offset = np.linalg.norm(state.landmarks[rows] - lifted.positions_camera[rows], axis=1)
    return float((offset * lifted.scores[rows]).max())
