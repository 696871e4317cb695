"""One hypothesis of a person, and the steps that move and judge it (steps 5 to 8).

The schedule that decides which hypothesis takes which step stands in `body_fit`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool

from pop_core.body.model import BodyModel
from pop_core.fitting.body_state import GLOBAL_ORIENT, TRANSL, BodyState, betas_slice
from pop_core.fitting.correspondence import (
    match_points,
    match_vertices,
    tangential_pairs,
    thin_points,
)
from pop_core.fitting.depth_consistency import (
    HidingPlaces,
    Visibility,
    depth_energy,
    free_space_pairs,
    render_bodies,
    render_body,
    see_body,
)
from pop_core.fitting.energy import BodyEnergy, PriorBelief, TermWeights
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.ground_contact import ground_pairs, measured_feet
from pop_core.fitting.levenberg_marquardt import FIRST_DAMPING, cost_of, levenberg_marquardt_step
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs, join_pairs, merged_pairs
from pop_core.fitting.robust_loss import Power
from pop_core.fitting.seat_contact import find_seat, seat_pairs
from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.segmentation.body_segmentation import SegmentationConfig, segment_body

WIDEST_M = 0.15  # first scale of the robust surface kernel
TANGENTIAL_SHARE = 0.3  # of point to point beside point to plane, at the widest kernel
# The surface knows better than keypoints once the kernel is narrower than this.
TRUSTED_M = 0.10
# Weight of E_depth [per metre of mean pixel error] beside the other terms' costs.
DEPTH_SCORE = 2000.0


@dataclass(slots=True, eq=False)
class Hypothesis:
    """A body being fitted, with the belief it started from and its damping."""

    state: BodyState
    belief: PriorBelief
    damping: float = FIRST_DAMPING
    cost: float = np.inf


class HypothesisSteps:
    """What can be done with a hypothesis of one model under one configuration."""

    def __init__(
        self, model: BodyModel, config: FittingConfig, segmentation: SegmentationConfig
    ) -> None:
        """Keep the model and settings."""
        self.model, self.config, self.segmentation = model, config, segmentation

    def fit_joints(self, hypothesis: Hypothesis, observation: Observation) -> None:
        """Fit placement and scale, then the pose under strong constraints (Eq. 2).

        What a retrieved pose is wrong about, the surface tells better than a few keypoints, some
        of them wrong: followed to the end, those ruin poses that were right.
        """
        strong = self.weights(strength=4.0)
        placement = self._active(pose=False, betas=False)
        pose = self._active(pose=True, betas=False)
        for active in (placement, pose, pose):
            self._step(hypothesis, observation, strong, active, [])

    def fit_surface(
        self,
        hypothesis: Hypothesis,
        observation: Observation,
        scales_m: Sequence[float],
        *,
        free_space: bool,
    ) -> None:
        """Fit pose, then pose and shape, to H with a shrinking robust kernel (E_NN, E_depth).

        Args:
            hypothesis: Moved in place.
            observation: What the sensor says.
            scales_m: Scale of the kernel in each step [m].
            free_space: Whether space that the sensor saw through pushes the body out.
        """
        segment = None
        for k, scale_m in enumerate(scales_m):
            visibility = see_body(hypothesis.state, observation)
            if segment is None or k % 2 == 0:
                segment = self.segment(visibility.rendered, observation)
            # What merged pairs cost less is the same for every step from here.
            surface, _ = self.surface_pairs(
                hypothesis.state, observation, visibility, segment, scale_m)
            pairs = [surface]
            if free_space and self.config.free_space:
                pairs.append(self._free_space(hypothesis.state, observation, visibility, segment))
            if self.config.seat_contact:
                seat = find_seat(hypothesis.state, observation, segment)
                pairs += [] if seat is None else [seat_pairs(hypothesis.state, seat)]
            # Keypoints stay as a stability penalty (Eq. 2).
            weights = self.weights(joints=min(1.0, scale_m / TRUSTED_M))
            active = self._active(pose=True, betas=free_space or k >= 2)
            self._step(hypothesis, observation, weights, active, pairs)

    def score(
        self,
        hypotheses: Sequence[Hypothesis],
        observation: Observation,
        segment: Bool[np.ndarray, 'h w'],
    ) -> None:
        """Set each hypothesis's cost: E_depth on common pixels, keypoints and priors beside it."""
        bodies_m = render_bodies([hypothesis.state for hypothesis in hypotheses], observation)
        for hypothesis, body_m in zip(hypotheses, bodies_m, strict=True):
            floor = None
            if observation.ground is not None:
                floor = ground_pairs(
                    hypothesis.state, observation.ground, observation.lifted, Power.COMPARED,
                    measured_feet(hypothesis.state, observation))
            energy = BodyEnergy(
                hypothesis.state, observation, hypothesis.belief, self.weights(), floor,
                power=Power.COMPARED)
            hypothesis.cost = DEPTH_SCORE * depth_energy(body_m, observation, segment) + cost_of(
                energy.terms(hypothesis.state, False))

    def common_segment(
        self, hypotheses: Sequence[Hypothesis], observation: Observation
    ) -> Bool[np.ndarray, 'h w']:
        """Return the pixels that at least half of the hypotheses call the person."""
        return majority(self.claims(hypotheses, observation))

    def claims(
        self, hypotheses: Sequence[Hypothesis], observation: Observation
    ) -> Bool[np.ndarray, 'k h w']:
        """Return the pixels that each hypothesis calls the person."""
        return np.array([
            self.segment(render_body(h.state, observation), observation) for h in hypotheses])

    def segment(
        self, rendered: RenderedDepth, observation: Observation
    ) -> Bool[np.ndarray, 'h w']:
        """Return the pixels of a hypothesis (step 6) in the thinned window."""
        # Pixels of a thinned window are further apart, and so is the depth between them.
        gamma = self.segmentation.gamma_m * observation.window.stride
        near = segment_body(
            observation.depth_m, rendered, observation.own, observation.camera.fx,
            replace(self.segmentation, gamma_m=min(gamma, 0.2)), observation.noise)
        # What was recognised as the person is to be explained, however far the body is from it.
        return near | observation.recognised

    def surface_pairs(
        self,
        state: BodyState,
        observation: Observation,
        visibility: Visibility,
        segment: Bool[np.ndarray, 'h w'],
        scale_m: float,
    ) -> tuple[Pairs, float]:
        """Return the pairs of E_NN, in both directions, merged, and how much less they cost."""
        points, parts = thin_points(observation, segment, self.config.surface_points)
        toward = match_points(
            state, visibility, points, parts, scale_m, observation.noise)
        back = match_vertices(state, visibility, observation, scale_m)
        # Point to point fades as the kernel shrinks and normals can be trusted.
        tangential, apart = tangential_pairs(toward, TANGENTIAL_SHARE * scale_m / WIDEST_M)
        planes, off_plane = merged_pairs(join_pairs([toward, back]))
        return join_pairs([planes, tangential]), apart + off_plane

    def weights(self, strength: float = 1.0, joints: float = 1.0) -> TermWeights:
        """Return the weights of keypoints and of priors of some strength."""
        config = self.config
        return TermWeights(
            joints, strength * config.prior_weight, strength * config.neighbour_weight,
            config.collision_weight, config.expected_weight)

    def _step(
        self,
        hypothesis: Hypothesis,
        observation: Observation,
        weights: TermWeights,
        active: Bool[np.ndarray, 'x'],
        pairs: Sequence[Pairs],
    ) -> None:
        every = list(pairs)
        if observation.ground is not None:
            every.append(ground_pairs(
                hypothesis.state, observation.ground, observation.lifted,
                measured=measured_feet(hypothesis.state, observation)))
        energy = BodyEnergy(
            hypothesis.state, observation, hypothesis.belief, weights,
            join_pairs(every) if every else None)
        report = levenberg_marquardt_step(
            hypothesis.state, energy.terms, BodyState.moved, active, hypothesis.damping)
        hypothesis.state, hypothesis.damping = report.state, report.damping
        hypothesis.cost = report.cost_after

    def _free_space(
        self,
        state: BodyState,
        observation: Observation,
        visibility: Visibility,
        segment: Bool[np.ndarray, 'h w'],
    ) -> Pairs:
        places = HidingPlaces(observation, segment, state.vertices[:, 2])
        free = free_space_pairs(state, visibility, places)
        # A denser mesh has more vertices in the same space: each counts for less.
        share = len(self.model.fit_vertices) / len(state.vertices)
        return replace(free, weight=free.weight * share)

    def _active(self, *, pose: bool, betas: bool) -> Bool[np.ndarray, 'x']:
        active = np.full(3 + 72 + self.model.n_betas + 1, pose)
        active[TRANSL], active[GLOBAL_ORIENT], active[-1] = True, True, True
        active[betas_slice(self.model.n_betas)] = betas
        return active


def majority(claims: Bool[np.ndarray, 'k h w']) -> Bool[np.ndarray, 'h w']:
    """Return the pixels that at least half of several masks hold."""
    return np.asarray(claims.mean(axis=0) >= 0.5)
