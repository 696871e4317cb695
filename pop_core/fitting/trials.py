"""Other versions of a hypothesis: made with another pose, and taken only where they cost less."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pop_core.fitting.hypotheses import Hypothesis

Judge = Callable[[Sequence[Hypothesis]], None]


def cheapest(
    best: Hypothesis, trials: Sequence[Hypothesis], judge: Judge, margin: float
) -> Hypothesis:
    """Return the cheapest trial if it saves more than a margin, else the best so far.

    Args:
        best: Its cost is known.
        trials: What to compare with it.
        judge: Sets the cost of hypotheses.
        margin: Cost that a trial must save.
    """
    judge(trials)
    trial = min(trials, key=lambda each: each.cost, default=best)
    return trial if trial.cost < best.cost - margin else best


def with_pose(
    hypothesis: Hypothesis, pose: Float[np.ndarray, '23 3'], expected: Float[np.ndarray, '23 3']
) -> Hypothesis:
    """Return a hypothesis in another pose, with the pose [rad] that is believed of it."""
    parameters = hypothesis.state.parameters.replaced(body_pose=pose)
    return replace(
        hypothesis, state=hypothesis.state.body.state(parameters),
        belief=replace(hypothesis.belief, pose=expected))
