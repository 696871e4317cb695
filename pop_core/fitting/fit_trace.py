"""A body fitter that remembers how its energies fell: to look at a fit, not to make it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.depth_consistency import depth_energy, see_body
from pop_core.fitting.energy import BodyEnergy, PriorBelief, TermWeights
from pop_core.fitting.hypotheses import Hypothesis, HypothesisSteps
from pop_core.fitting.levenberg_marquardt import cost_of
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs
from pop_core.retrieval.candidate import PoseCandidate

JOINTS, SURFACE, FREE_SPACE, POLISH = 'joints', 'surface', 'surface and free space', 'full mesh'


@dataclass(frozen=True, slots=True)
class TracedStep:
    """One step of one hypothesis.

    Args:
        hypothesis: Its number, by the retrieval's order.
        stage: Part of the fit that took the step.
        joints: E_J3D after the step (Eq. 2).
        depth: E_depth after the step, on the pixels it calls the person.
    """

    hypothesis: int
    stage: str
    joints: float
    depth: float


class TracedSteps(HypothesisSteps):
    """Steps that measure both energies after every one."""

    def begin(self) -> list[TracedStep]:
        """Return the list that the steps of the next person will be added to."""
        self._trace: list[TracedStep] = []
        self._beliefs: list[PriorBelief] = []
        self._stage = JOINTS
        return self._trace

    def fit_joints(self, hypothesis: Hypothesis, observation: Observation) -> None:
        """Fit placement, scale and pose to the joints, and remember it."""
        self._beliefs.append(hypothesis.belief)
        super().fit_joints(hypothesis, observation)

    def fit_surface(
        self, hypothesis: Hypothesis, observation: Observation, scales_m: Sequence[float], *,
        free_space: bool,
    ) -> None:
        """Fit to the surface, and remember it."""
        on_full_mesh = len(hypothesis.state.vertices) == len(self.model.v_template)
        self._stage = POLISH if on_full_mesh else FREE_SPACE if free_space else SURFACE
        super().fit_surface(hypothesis, observation, scales_m, free_space=free_space)

    def _step(
        self, hypothesis: Hypothesis, observation: Observation, weights: TermWeights,
        active: Bool[np.ndarray, 'x'], pairs: Sequence[Pairs],
    ) -> None:
        super()._step(hypothesis, observation, weights, active, pairs)
        # A polished body is a copy of the winner: they share what they believe.
        number = next(
            i for i, belief in enumerate(self._beliefs) if belief is hypothesis.belief)
        joints, depth = self._energies(hypothesis, observation)
        self._trace.append(TracedStep(number, self._stage, joints, depth))

    def _energies(
        self, hypothesis: Hypothesis, observation: Observation
    ) -> tuple[float, float]:
        state = hypothesis.state
        energy = BodyEnergy(state, observation, hypothesis.belief, self.weights(), None)
        joints = cost_of(energy.residuals(state, False)[:1])
        visibility = see_body(state, observation)
        segment = self.segment(visibility, observation)
        return joints, depth_energy(visibility, observation, segment)


class TracedBodyFitter(BodyFitter):
    """Fits as BodyFitter does, and remembers its steps."""

    def __init__(self, like: BodyFitter) -> None:
        """Take model and settings of another fitter."""
        segmentation = like.steps.segmentation
        super().__init__(like.model, like.prior, like.config, segmentation)
        self._traced = TracedSteps(like.model, like.config, segmentation)
        self.steps = self._traced
        self._traces: list[list[TracedStep]] = []

    def fit(self, observation: Observation, candidates: Sequence[PoseCandidate]) -> BodyFit:
        """Return the fit; its steps wait for `take_traces`."""
        self._traces.append(self._traced.begin())
        return super().fit(observation, candidates)

    def take_traces(self) -> list[list[TracedStep]]:
        """Return the steps of every person fitted since the last call."""
        taken, self._traces = self._traces, []
        return taken


def traced_like(fitter: BodyFitter) -> TracedBodyFitter:
    """Return a fitter of the same model and settings that remembers."""
    return TracedBodyFitter(fitter)
