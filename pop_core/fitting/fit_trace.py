"""Steps that remember how the energies fell: to look at a fit, not to make it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.fitting.depth_consistency import depth_energy, render_body
from pop_core.fitting.energy import BodyEnergy, TermWeights
from pop_core.fitting.hypotheses import Hypothesis, HypothesisSteps
from pop_core.fitting.levenberg_marquardt import cost_of
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs

JOINTS, SURFACE, FREE_SPACE, POLISH = 'joints', 'surface', 'surface and free space', 'full mesh'


@dataclass(frozen=True, slots=True)
class TracedStep:
    """One step of one hypothesis.

    Args:
        hypothesis: Its number, by the retrieval's order.
        stage: Part of the fit that took the step.
        joints: E_J3D after the step (Eq. 2).
        depth: E_depth after the step [m], on the pixels it calls the person.
    """

    hypothesis: int
    stage: str
    joints: float
    depth: float


class TracedSteps(HypothesisSteps):
    """Does what its model does, and measures both energies after every step."""

    def __init__(self, steps: HypothesisSteps) -> None:
        """Take over model and settings of other steps."""
        super().__init__(steps.model, steps.config, steps.segmentation)
        self._traces: list[list[TracedStep]] = []
        # A hypothesis is copied on its way and gets limbs of others; the spread of its neighbours
        # stays the same object.
        self._spreads: list[Float[np.ndarray, '23']] = []
        self._stage = POLISH

    def take_traces(self) -> list[list[TracedStep]]:
        """Return the steps of every person fitted since the last call."""
        taken, self._traces = self._traces, []
        return taken

    def fit_joints(self, hypothesis: Hypothesis, observation: Observation) -> None:
        """Fit joints; the first hypothesis after a fit to a surface begins another person."""
        if self._stage != JOINTS:
            self._traces.append([])
            self._spreads = []
        self._stage = JOINTS
        self._spreads.append(hypothesis.belief.sigma_rad)
        super().fit_joints(hypothesis, observation)

    def fit_surface(
        self, hypothesis: Hypothesis, observation: Observation, scales_m: Sequence[float], *,
        free_space: bool,
    ) -> None:
        """Fit the surface, and remember in which part of the schedule."""
        is_full = len(hypothesis.state.vertices) > len(self.model.fit_vertices)
        self._stage = POLISH if is_full else FREE_SPACE if free_space else SURFACE
        super().fit_surface(hypothesis, observation, scales_m, free_space=free_space)

    def _step(
        self, hypothesis: Hypothesis, observation: Observation, weights: TermWeights,
        active: Bool[np.ndarray, 'x'], pairs: Sequence[Pairs],
    ) -> None:
        super()._step(hypothesis, observation, weights, active, pairs)
        spread = hypothesis.belief.sigma_rad
        number = next(i for i, each in enumerate(self._spreads) if each is spread)
        joints, depth = self._energies(hypothesis, observation)
        self._traces[-1].append(TracedStep(number, self._stage, joints, depth))

    def _energies(
        self, hypothesis: Hypothesis, observation: Observation
    ) -> tuple[float, float]:
        state = hypothesis.state
        energy = BodyEnergy(state, observation, hypothesis.belief, self.weights(), None)
        joints = cost_of(energy.terms(state, False)[:1])
        rendered = render_body(state, observation)
        segment = self.segment(rendered, observation)
        return joints, depth_energy(rendered.depth_m, observation, segment)
