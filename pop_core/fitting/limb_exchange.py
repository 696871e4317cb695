"""Limbs exchanged between hypotheses: K bodies of four limbs hold K^4 combinations.

Retrieval finds whole poses, and the one with the right trunk may have a wrong arm that another one
has right. The surface cannot carry an arm across free space to where it is seen; trying the arms
of the others can.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from pop_core.body.joints import JOINT_INDEX
from pop_core.fitting.hypotheses import Hypothesis

MARGIN = 1.0  # cost that an exchange must save: less is noise

Judge = Callable[[Sequence[Hypothesis]], None]


def _limb(*names: str) -> Bool[np.ndarray, '23']:
    """Return which rotations of a body pose bend a limb."""
    chosen = np.zeros(23, dtype=bool)
    chosen[[JOINT_INDEX[name] - 1 for name in names]] = True
    return chosen


LIMBS = tuple(
    _limb(*(f'{side}_{joint}' for joint in joints))
    for joints in (('shoulder', 'elbow', 'wrist'), ('hip', 'knee', 'ankle'))
    for side in ('left', 'right'))


def exchange_limbs(
    best: Hypothesis, others: Sequence[Hypothesis], judge: Judge
) -> Hypothesis:
    """Return a hypothesis with the limbs of others where they explain what is seen better.

    Args:
        best: The hypothesis to improve; its cost is known.
        others: Where limbs are taken from.
        judge: Sets the cost of hypotheses.
    """
    for limb in LIMBS:
        trials = [_with_limb(best, other, limb) for other in others]
        judge(trials)
        cheapest = min(trials, key=lambda trial: trial.cost, default=best)
        if cheapest.cost < best.cost - MARGIN:
            best = cheapest
    return best


def _with_limb(
    hypothesis: Hypothesis, donor: Hypothesis, limb: Bool[np.ndarray, '23']
) -> Hypothesis:
    parameters = hypothesis.state.parameters
    theirs = donor.state.parameters.body_pose
    pose = np.where(limb[:, None], theirs, parameters.body_pose)
    expected = np.where(limb[:, None], donor.belief.pose, hypothesis.belief.pose)
    return replace(
        hypothesis,
        state=hypothesis.state.body.state(replace(parameters, body_pose=pose)),
        belief=replace(hypothesis.belief, pose=expected))
