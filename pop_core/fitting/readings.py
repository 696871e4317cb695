"""Other readings of a fitted body: limbs rolled back, legs exchanged, the whole body turned about.

Each keeps the joints nearly where they are, so neither joints nor surface lead from one to the
other by small steps; the same cost that compares hypotheses decides between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.model import BodyParameters
from pop_core.fitting.bone_rolls import rolled_limbs, unrolled
from pop_core.fitting.hypotheses import Hypothesis, HypothesisSteps
from pop_core.fitting.levenberg_marquardt import FIRST_DAMPING
from pop_core.fitting.observation import Observation
from pop_core.fitting.side_exchange import turned_around, with_legs_exchanged
from pop_core.fitting.trials import Judge, cheapest

MARGIN = 2.0  # cost that another reading must save: detectors rarely take left for right
HOPEFUL = 60.0  # a turned body may win once it is fitted, if it costs no more than this beyond
LEG_JOINTS = [SHARED_INDEX[f'{side}_{name}'] for side in ('left', 'right')
              for name in ('knee', 'ankle')]


def best_reading(
    hypothesis: Hypothesis, observation: Observation, judge: Judge
) -> Hypothesis:
    """Return a hypothesis with limbs rolled back or legs exchanged, where that costs less.

    Args:
        hypothesis: Its cost is known.
        observation: Tells whether legs are named by keypoints.
        judge: Sets the cost of hypotheses.
    """
    trials = []
    state = hypothesis.state
    model, parameters = state.body.model, state.parameters
    if rolled_limbs(parameters.body_pose):
        pose = unrolled(parameters.body_pose, state.skeleton.rest_joints)
        trials.append(_reading(hypothesis, parameters.replaced(body_pose=pose)))
    if np.count_nonzero(observation.lifted.lifted[LEG_JOINTS]) < len(LEG_JOINTS) - 1:
        trials.append(_reading(hypothesis, with_legs_exchanged(model, parameters)))
    return cheapest(hypothesis, trials, judge, MARGIN)


def best_facing(
    winner: Hypothesis,
    observation: Observation,
    steps: HypothesisSteps,
    schedule: Sequence[tuple[Sequence[float], bool]],
) -> tuple[Hypothesis, Observation]:
    """Return a body or the one turned about, whichever costs less, and what it was fitted to.

    A detector that takes a back for a front names every joint after the other side. The turned
    body is therefore fitted to the joints with their sides exchanged; only the surface can tell.

    Args:
        winner: The body that explains the keypoints as they are named.
        observation: What it was fitted to.
        steps: Fit and judge the turned body.
        schedule: Scales of the robust kernel [m], and whether free space pushes, part by part.
    """
    segment = steps.common_segment([winner], observation)
    other = observation.with_sides_exchanged()
    body = winner.state.body
    turned = _reading(winner, turned_around(body.model, winner.state.parameters))
    steps.score([winner], observation, segment)
    steps.score([turned], other, segment)
    if turned.cost > winner.cost + HOPEFUL:
        return winner, observation
    for scales_m, free_space in schedule:
        steps.fit_surface(turned, other, scales_m, free_space=free_space)
    steps.score([turned], other, segment)
    if turned.cost > winner.cost - MARGIN:
        return winner, observation
    return turned, other


def _reading(hypothesis: Hypothesis, parameters: BodyParameters) -> Hypothesis:
    """Return a hypothesis with other parameters, that expects them."""
    return replace(
        hypothesis, state=hypothesis.state.body.state(parameters), damping=FIRST_DAMPING,
        belief=replace(hypothesis.belief, pose=parameters.body_pose))
