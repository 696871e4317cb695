"""Limbs exchanged between hypotheses: K bodies of four limbs hold K^4 combinations.

Retrieval finds whole poses, and the one with the right trunk may have a wrong arm that another one
has right. The surface cannot carry an arm across free space to where it is seen; trying the arms
of the others can.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pop_core.fitting.hypotheses import Hypothesis
from pop_core.fitting.limb_points import KINDS
from pop_core.fitting.trials import Judge, cheapest, with_pose

MARGIN = 1.0  # cost that an exchange must save: less is noise
LIMBS = tuple(np.isin(np.arange(23), kind.rows) for kind in KINDS)  # rotations that bend a limb


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
        turns, pose = limb[:, None], best.state.parameters.body_pose
        trials = [
            with_pose(
                best, np.where(turns, other.state.parameters.body_pose, pose),
                np.where(turns, other.belief.pose, best.belief.pose))
            for other in others]
        best = cheapest(best, trials, judge, MARGIN)
    return best
