"""The fit of one person: K hypotheses through the paper's steps 5 to 8, best one polished."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import GLOBAL_ORIENT, TRANSL, BodyState, FitBody, betas_slice
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
    see_body,
)
from pop_core.fitting.energy import BodyEnergy, PriorBelief, TermWeights
from pop_core.fitting.ground_contact import ground_pairs
from pop_core.fitting.initialisation import initial_parameters
from pop_core.fitting.levenberg_marquardt import FIRST_DAMPING, cost_of, levenberg_marquardt_step
from pop_core.fitting.observation import Observation
from pop_core.fitting.priors import neighbour_sigma_rad
from pop_core.fitting.residuals import Pairs, join_pairs
from pop_core.fitting.robust_loss import geman_mcclure_share
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import PosePrior
from pop_core.segmentation.body_segmentation import SegmentationConfig, segment_body
from pop_core.settings import setting


@dataclass(frozen=True, slots=True)
class FittingConfig:
    """How hypotheses are fitted and chosen."""

    surface_hypotheses: int = setting(
        4, minimum=1, maximum=12,
        about='Hypotheses that reach the surface fit, best of E_J3D first.')
    final_hypotheses: int = setting(
        2, minimum=1, maximum=12,
        about='Hypotheses that are fitted to the end, best of E_depth first.')
    surface_points: int = setting(
        700, minimum=50, maximum=20000,
        about='Most measured points that pull on the body in one step.')
    polish_steps: int = setting(
        1, minimum=0, maximum=20,
        about='Steps of the winner on the full mesh.')
    prior_weight: float = setting(
        0.15, minimum=0.0, maximum=100.0,
        about='Weight of the learned pose prior.')
    neighbour_weight: float = setting(
        0.15, minimum=0.0, maximum=100.0,
        about='Weight of the conditional prior: stay near the retrieved pose where all agree.')
    free_space: bool = setting(
        True, about='Whether bodies are pushed out of space the sensor saw through.')


@dataclass(frozen=True, slots=True, eq=False)
class BodyFit:
    """The result of fitting one person.

    Args:
        parameters: The winner.
        hessian: J'WJ of all terms at the winner, parameters ordered as the solver's.
        visibility: Sight of the coarse mesh at the winner.
        coarse: The winner on the coarse mesh.
        segment: Pixels of the observation that show the person.
        energies: Final energies by name.
        runners_up: The other finalists, best first.
    """

    parameters: BodyParameters
    hessian: Float[np.ndarray, 'x x']
    visibility: Visibility
    coarse: BodyState
    segment: Bool[np.ndarray, 'h w']
    energies: dict[str, float]
    runners_up: tuple[BodyParameters, ...]


@dataclass(slots=True, eq=False)
class Hypothesis:
    """A body being fitted, with the belief it started from and its damping."""

    state: BodyState
    belief: PriorBelief
    damping: float = FIRST_DAMPING
    cost: float = np.inf


class BodyFitter:
    """Fits bodies of one model; prepared once, used for every person."""

    def __init__(
        self,
        model: BodyModel,
        prior: PosePrior,
        config: FittingConfig | None = None,
        segmentation: SegmentationConfig | None = None,
    ) -> None:
        """Prepare a model, coarse and full."""
        self.model, self.prior = model, prior
        self.config = config or FittingConfig()
        self.segmentation = segmentation or SegmentationConfig()
        self.coarse = FitBody(model, full=False)
        self.full = FitBody(model, full=True)

    def fit(self, observation: Observation, candidates: Sequence[PoseCandidate]) -> BodyFit:
        """Return the body that explains an observation best, started from retrieved poses."""
        hypotheses = [self._start(candidate, candidates) for candidate in candidates]
        for hypothesis in hypotheses:
            self._fit_joints(hypothesis, observation)
        hypotheses = _best(hypotheses, self.config.surface_hypotheses)
        for hypothesis in hypotheses:
            self._fit_surface(hypothesis, observation, EARLY_SCALES_M, free_space=False)
        segment = self._common_segment(hypotheses, observation)
        self._score(hypotheses, observation, segment)
        hypotheses = _best(hypotheses, self.config.final_hypotheses)
        for hypothesis in hypotheses:
            self._fit_surface(hypothesis, observation, LATE_SCALES_M, free_space=True)
        segment = self._common_segment(hypotheses, observation)
        self._score(hypotheses, observation, segment)
        return self._finish(_best(hypotheses, len(hypotheses)), observation)

    # Step 5 -------------------------------------------------------------------------------

    def _start(self, candidate: PoseCandidate, all_of_them: Sequence[PoseCandidate]) -> Hypothesis:
        parameters = initial_parameters(self.model, candidate)
        belief = PriorBelief(self.prior, parameters.body_pose, neighbour_sigma_rad(all_of_them))
        return Hypothesis(self.coarse.state(parameters), belief)

    def _fit_joints(self, hypothesis: Hypothesis, observation: Observation) -> None:
        """Fit placement and scale, then the pose under strong and weaker constraints (Eq. 2)."""
        strong, weak = self._weights(4.0), self._weights(1.0)
        placement = self._active(pose=False, betas=False)
        pose = self._active(pose=True, betas=False)
        for active, weights, steps in ((placement, strong, 1), (pose, strong, 2), (pose, weak, 3)):
            for _ in range(steps):
                self._step(hypothesis, observation, weights, active, None)

    # Steps 6 to 8 --------------------------------------------------------------------------

    def _fit_surface(
        self,
        hypothesis: Hypothesis,
        observation: Observation,
        scales_m: Sequence[float],
        *,
        free_space: bool,
    ) -> None:
        """Fit pose, then pose and shape, to H with a shrinking robust kernel (E_NN, E_depth)."""
        segment = None
        for k, scale_m in enumerate(scales_m):
            visibility = see_body(hypothesis.state, observation)
            if segment is None or k % 2 == 0:
                segment = self._segment(visibility, observation)
            pairs = self._pairs(hypothesis.state, observation, visibility, segment, scale_m)
            if free_space and self.config.free_space:
                free = self._free_space(hypothesis.state, observation, visibility, segment)
                pairs = join_pairs([pairs, free])
            # The surface knows better than keypoints; they stay as a stability penalty (Eq. 2).
            weights = self._weights(1.0, joints=min(1.0, scale_m / 0.10))
            active = self._active(pose=True, betas=free_space or k >= 2)
            self._step(hypothesis, observation, weights, active, pairs)

    def _finish(self, finalists: list[Hypothesis], observation: Observation) -> BodyFit:
        winner = finalists[0]
        polished = self._polish(winner, observation)
        coarse = self.coarse.state(polished.state.parameters)
        visibility = see_body(coarse, observation)
        segment = self._segment(visibility, observation)
        pairs = self._pairs(coarse, observation, visibility, segment, LATE_SCALES_M[-1])
        energy = BodyEnergy(coarse, observation, winner.belief, self._weights(1.0), pairs)
        blocks = energy.residuals(coarse, True)
        hessian = sum(
            (b.J.T @ (b.w[:, None] * b.J) for b in blocks if b.J is not None),
            np.zeros((self.coarse.size, self.coarse.size)))
        energies = {
            'E_J3D': cost_of(blocks[:1]), 'E_prior': cost_of(blocks[2:6]),
            'E_NN': cost_of(blocks[6:]), 'E_depth': depth_energy(visibility, observation, segment),
        }
        others = tuple(other.state.parameters for other in finalists[1:])
        return BodyFit(
            coarse.parameters, hessian, visibility, coarse, segment, energies, others)

    def _polish(self, winner: Hypothesis, observation: Observation) -> Hypothesis:
        """Take the last steps on the full mesh: the coarse one cuts the corners of limbs."""
        hypothesis = replace(winner, state=self.full.state(winner.state.parameters))
        for _ in range(self.config.polish_steps):
            state = hypothesis.state
            visibility = see_body(state, observation)
            segment = self._segment(visibility, observation)
            pairs = self._pairs(state, observation, visibility, segment, LATE_SCALES_M[-1])
            if self.config.free_space:
                free = self._free_space(state, observation, visibility, segment)
                pairs = join_pairs([pairs, free])
            weights = self._weights(1.0, joints=LATE_SCALES_M[-1] / 0.10)
            active = self._active(pose=True, betas=True)
            self._step(hypothesis, observation, weights, active, pairs)
        return hypothesis

    # Parts ---------------------------------------------------------------------------------

    def _step(
        self,
        hypothesis: Hypothesis,
        observation: Observation,
        weights: TermWeights,
        active: Bool[np.ndarray, 'x'],
        pairs: Pairs | None,
    ) -> None:
        parts = [] if pairs is None else [pairs]
        if observation.ground is not None:
            parts.append(ground_pairs(hypothesis.state, observation.ground, observation.lifted))
        energy = BodyEnergy(
            hypothesis.state, observation, hypothesis.belief, weights,
            join_pairs(parts) if parts else None)
        report = levenberg_marquardt_step(
            hypothesis.state, energy.residuals, BodyState.moved, active, hypothesis.damping)
        hypothesis.state, hypothesis.damping = report.state, report.damping
        hypothesis.cost = report.cost_after

    def _pairs(
        self,
        state: BodyState,
        observation: Observation,
        visibility: Visibility,
        segment: Bool[np.ndarray, 'h w'],
        scale_m: float,
    ) -> Pairs:
        points, _ = thin_points(observation, segment, self.config.surface_points)
        toward = match_points(state, visibility, points, scale_m)
        back = match_vertices(state, visibility, scale_m)
        # Point to point fades as the kernel shrinks and normals can be trusted.
        tangential = tangential_pairs(toward, 0.3 * scale_m / EARLY_SCALES_M[0])
        return join_pairs([toward, tangential, back])

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

    def _segment(
        self, visibility: Visibility, observation: Observation
    ) -> Bool[np.ndarray, 'h w']:
        # Pixels of a thinned window are further apart, and so is the depth between them.
        gamma = self.segmentation.gamma_m * observation.window.stride
        return segment_body(
            observation.depth_m, visibility.rendered, observation.own, observation.camera.fx,
            replace(self.segmentation, gamma_m=min(gamma, 0.2)))

    def _common_segment(
        self, hypotheses: Sequence[Hypothesis], observation: Observation
    ) -> Bool[np.ndarray, 'h w']:
        """Return the pixels that at least half of the hypotheses call the person."""
        votes = [self._segment(see_body(h.state, observation), observation) for h in hypotheses]
        return np.mean(votes, axis=0) >= 0.5

    def _score(
        self,
        hypotheses: Sequence[Hypothesis],
        observation: Observation,
        segment: Bool[np.ndarray, 'h w'],
    ) -> None:
        """Set each hypothesis's cost: E_depth on common pixels, keypoints and priors beside it."""
        for hypothesis in hypotheses:
            floor = None
            if observation.ground is not None:
                floor = ground_pairs(
                    hypothesis.state, observation.ground, observation.lifted, geman_mcclure_share)
            energy = BodyEnergy(
                hypothesis.state, observation, hypothesis.belief, self._weights(1.0), floor,
                kernel=geman_mcclure_share)
            rest = cost_of(energy.residuals(hypothesis.state, False))
            visibility = see_body(hypothesis.state, observation)
            depth = depth_energy(visibility, observation, segment)
            hypothesis.cost = DEPTH_SCORE * depth + rest

    def _weights(self, strength: float, joints: float = 1.0) -> TermWeights:
        config = self.config
        return TermWeights(
            joints, strength * config.prior_weight, strength * config.neighbour_weight)

    def _active(self, *, pose: bool, betas: bool) -> Bool[np.ndarray, 'x']:
        active = np.full(self.coarse.size, pose)
        active[TRANSL], active[GLOBAL_ORIENT], active[-1] = True, True, True
        active[betas_slice(self.model.n_betas)] = betas
        return active


# The robust kernel shrinks as the body settles [m].
EARLY_SCALES_M = (0.15, 0.13, 0.11, 0.09)
LATE_SCALES_M = (0.08, 0.06, 0.045, 0.035, 0.03)
# Weight of E_depth [per metre of mean pixel error] beside the other terms' costs.
DEPTH_SCORE = 1000.0


def _best(hypotheses: Sequence[Hypothesis], count: int) -> list[Hypothesis]:
    return sorted(hypotheses, key=lambda hypothesis: hypothesis.cost)[:count]
