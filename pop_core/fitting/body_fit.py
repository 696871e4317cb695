"""The fit of one person: K hypotheses through the paper's steps 5 to 8, best one polished."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.estimate import RunnerUp
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.depth_consistency import Visibility, depth_energy, see_body
from pop_core.fitting.disagreement import Disagreement, disagreement, unnamed_joints
from pop_core.fitting.energy import PAIR_BLOCKS, PRIOR_BLOCKS, BodyEnergy, PriorBelief
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.hypotheses import WIDEST_M, Hypothesis, HypothesisSteps, majority
from pop_core.fitting.initialisation import initial_parameters
from pop_core.fitting.levenberg_marquardt import assemble, cost_of
from pop_core.fitting.limb_exchange import exchange_limbs
from pop_core.fitting.limb_points import KINDS
from pop_core.fitting.limb_proposals import LimbProposals
from pop_core.fitting.observation import Observation
from pop_core.fitting.priors import neighbour_sigma_rad
from pop_core.fitting.readings import best_facing, best_reading
from pop_core.fitting.trials import Judge, cheapest
from pop_core.fitting.unclaimed_surface import UnclaimedSurface
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import PosePrior
from pop_core.segmentation.body_segmentation import SegmentationConfig

# The robust kernel shrinks as the body settles [m].
EARLY_SCALES_M = (WIDEST_M, 0.13, 0.11, 0.09)
LATE_SCALES_M = (0.08, 0.06, 0.045, 0.035, 0.03)
SEARCHED_SCALES_M = (0.12, *LATE_SCALES_M)  # a limb that was found is a few centimetres off
PROMISING = 8.0  # cost beyond the winner's that fitting a limb may save
SAVED = 1.0  # cost that a fitted limb must save
TURNED_SCHEDULE = ((EARLY_SCALES_M[-2:], False), (LATE_SCALES_M, True))


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
        runners_up: The other hypotheses, cheapest first.
        disagreement: What other hypotheses and keypoints say against the winner.
        sides_exchanged: Whether the keypoints' left turned out to be right.
    """

    parameters: BodyParameters
    hessian: Float[np.ndarray, 'x x']
    visibility: Visibility
    coarse: BodyState
    segment: Bool[np.ndarray, 'h w']
    energies: dict[str, float]
    runners_up: tuple[RunnerUp, ...]
    disagreement: Disagreement
    sides_exchanged: bool = False


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
        self.steps = HypothesisSteps(model, self.config, segmentation or SegmentationConfig())
        self.coarse = FitBody(model, full=False)
        self.full = FitBody(model, full=True)
        self.limbs = LimbProposals(prior)

    def fit(self, observation: Observation, candidates: Sequence[PoseCandidate]) -> BodyFit:
        """Return the body that explains an observation best, started from retrieved poses.

        All candidates are fitted to the joints (step 5), the better ones to the surface (steps 6
        and 7), the best of those, with limbs of the others where they serve better, to the end
        with the free space (step 8). Limbs that still explain little are looked for anew,
        and other ways of the winner's are fitted, too, before they are compared with it.
        """
        unclaimed = UnclaimedSurface(observation)
        started = [self._start(candidate, candidates) for candidate in candidates]
        for hypothesis in started:
            self.steps.fit_joints(hypothesis, observation)
        hypotheses = _best(started, self.config.surface_hypotheses)
        for hypothesis in hypotheses:
            self.steps.fit_surface(hypothesis, observation, EARLY_SCALES_M, free_space=False)
        judge = self._judge(observation, self._compare(hypotheses, observation, unclaimed))
        finalists = _best(hypotheses, self.config.final_hypotheses)
        left_behind = [hypothesis for hypothesis in started if hypothesis not in finalists]
        hypotheses = [
            exchange_limbs(hypothesis, [h for h in started if h is not hypothesis], judge)
            for hypothesis in finalists]
        if self.config.other_readings:
            hypotheses = [best_reading(each, observation, judge) for each in hypotheses]
        for hypothesis in hypotheses:
            self.steps.fit_surface(hypothesis, observation, LATE_SCALES_M, free_space=True)
        segment = self._compare(hypotheses, observation, unclaimed)
        observation = replace(observation, standing_clear=unclaimed.found)
        for _ in range(self.config.limb_searches):
            found = self._with_limbs_found(hypotheses, started, observation, segment)
            kept = _best([*hypotheses, *found], len(hypotheses))
            if not any(each in found for each in kept):
                break
            hypotheses, segment = kept, self._compare(kept, observation, unclaimed)
        winner, *others = _best(hypotheses, len(hypotheses))
        winner = self._with_limbs_fitted(winner, started, observation, segment)
        self._judge(observation, segment)(left_behind)
        runners_up = _runners_up(winner, others, left_behind)
        excess = [other.cost - winner.cost for other in others]
        named = observation
        if self.config.other_readings:
            winner, named = best_facing(winner, observation, self.steps, TURNED_SCHEDULE)
        body = self._polished(winner, named)
        left = disagreement(
            body.state, [other.state for other in others], excess,
            [hypothesis.state for hypothesis in started],
            unnamed_joints(body.state, named.lifted))
        fit = self._finish(body, runners_up, named, left)
        return replace(fit, sides_exchanged=named is not observation)

    def costs(
        self, fits: Sequence[BodyFit], observations: Sequence[Observation]
    ) -> list[float]:
        """Return what each of several fits of one person costs, on the pixels of all of them.

        Args:
            fits: Bodies.
            observations: What each was fitted to: keypoints read differently, one person.
        """
        window = observations[0]
        # One window for all: where another lies depends on what was lifted.
        read = [
            replace(
                window, lifted=each.lifted, keypoint_rays=each.keypoint_rays,
                expected=each.expected)
            for each in observations]
        bodies = [
            Hypothesis(fit.coarse, PriorBelief(
                self.prior, fit.parameters.body_pose, np.ones(len(fit.parameters.body_pose))))
            for fit in fits]
        segment = self.steps.common_segment(bodies, window)
        for fit, body, seen in zip(fits, bodies, read, strict=True):
            named = seen.with_sides_exchanged() if fit.sides_exchanged else seen
            self.steps.score([body], named, segment)
        return [body.cost for body in bodies]

    def _start(self, candidate: PoseCandidate, all_of_them: Sequence[PoseCandidate]) -> Hypothesis:
        parameters = initial_parameters(self.model, candidate)
        belief = PriorBelief(self.prior, parameters.body_pose, neighbour_sigma_rad(all_of_them))
        return Hypothesis(self.coarse.state(parameters), belief)

    def _with_limbs_found(
        self, hypotheses: Sequence[Hypothesis], donors: Sequence[Hypothesis],
        observation: Observation, segment: Bool[np.ndarray, 'h w'],
    ) -> list[Hypothesis]:
        """Return hypotheses that took limbs which were looked for anew, fitted with them."""
        judge = self._judge(observation, segment)
        found = []
        for hypothesis in hypotheses:
            better = self.limbs.improve(hypothesis, donors, observation, segment, judge)
            if better is not hypothesis:
                self.steps.fit_surface(better, observation, SEARCHED_SCALES_M, free_space=True)
                found.append(better)
        judge(found)
        return found

    def _with_limbs_fitted(
        self, winner: Hypothesis, donors: Sequence[Hypothesis], observation: Observation,
        segment: Bool[np.ndarray, 'h w'],
    ) -> Hypothesis:
        """Return a hypothesis with those other limbs that cost less once they are fitted, too.

        A limb as it was drawn is a few centimetres off and costs for that: beside a fitted one it
        loses though it is right.
        """
        judge = self._judge(observation, segment)
        for kind in KINDS:
            trials = self.limbs.trials(winner, kind, donors, observation, segment)
            judge(trials)
            promising = [trial for trial in _best(trials, self.config.limb_trials)
                         if trial.cost < winner.cost + PROMISING]
            for trial in promising:
                self.steps.fit_surface(trial, observation, SEARCHED_SCALES_M, free_space=True)
            winner = cheapest(winner, promising, judge, SAVED)
        return winner

    def _compare(
        self, hypotheses: Sequence[Hypothesis], observation: Observation,
        unclaimed: UnclaimedSurface,
    ) -> Bool[np.ndarray, 'h w']:
        """Set costs by E_depth over the pixels to explain; return those pixels.

        They are what most hypotheses call the person's, and what none does though it hangs
        together with the skeleton.
        """
        claims = self.steps.claims(hypotheses, observation)
        segment = majority(claims) | unclaimed.pieces(np.any(claims, axis=0))
        self._judge(observation, segment)(hypotheses)
        return segment

    def _judge(self, observation: Observation, segment: Bool[np.ndarray, 'h w']) -> Judge:
        """Return what sets costs by E_depth over some pixels."""
        return lambda judged: self.steps.score(judged, observation, segment)

    def _polished(self, winner: Hypothesis, observation: Observation) -> Hypothesis:
        """Take the last steps on the full mesh: the coarse one cuts the corners of limbs."""
        hypothesis = replace(winner, state=self.full.state(winner.state.parameters))
        scales_m = LATE_SCALES_M[-1:] * self.config.polish_steps
        self.steps.fit_surface(hypothesis, observation, scales_m, free_space=True)
        return hypothesis

    def _finish(
        self, winner: Hypothesis, runners_up: tuple[RunnerUp, ...], observation: Observation,
        left: Disagreement,
    ) -> BodyFit:
        """Return the winner with its energies and the curvature of its cost."""
        coarse = self.coarse.state(winner.state.parameters)
        visibility = see_body(coarse, observation)
        segment = self.steps.segment(visibility.rendered, observation)
        pairs, spread = self.steps.surface_pairs(
            coarse, observation, visibility, segment, LATE_SCALES_M[-1])
        energy = BodyEnergy(coarse, observation, winner.belief, self.steps.weights(), pairs)
        blocks = energy.terms(coarse, True)
        energies = {
            'E_J3D': cost_of(blocks[:1]), 'E_prior': cost_of(blocks[PRIOR_BLOCKS]),
            'E_NN': cost_of(blocks[PAIR_BLOCKS]) + spread,
            'E_depth': depth_energy(visibility.rendered.depth_m, observation, segment),
        }
        return BodyFit(
            coarse.parameters, assemble(blocks, self.coarse.size).hessian, visibility, coarse,
            segment, energies, runners_up, left)


def _best(hypotheses: Sequence[Hypothesis], count: int) -> list[Hypothesis]:
    return sorted(hypotheses, key=lambda hypothesis: hypothesis.cost)[:count]


def _runners_up(
    winner: Hypothesis, finished: Sequence[Hypothesis], left_behind: Sequence[Hypothesis]
) -> tuple[RunnerUp, ...]:
    """Return the hypotheses that did not win, cheapest first; all judged on the same pixels."""
    every = [
        *((other, True) for other in finished), *((other, False) for other in left_behind)]
    every.sort(key=lambda item: item[0].cost)
    return tuple(
        RunnerUp(other.state.parameters, other.cost - winner.cost, is_finished)
        for other, is_finished in every)
