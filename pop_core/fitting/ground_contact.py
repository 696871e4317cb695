"""Contact with the floor: bodies stand on it, never below it.

A hidden leg is seen through the floor: where the pelvis is high, the person stands, where it is
low, they sit or crouch. Feet are drawn to the floor softly, since people also jump, climb and lie
on beds; standing below the floor is forbidden.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.residuals import Pairs, join_pairs
from pop_core.fitting.robust_loss import Kernel, geman_mcclure_weight
from pop_core.segmentation.ground import Ground

BELOW_SIGMA_M = 0.01
CONTACT_SIGMA_M = 0.03
CONTACT_SCALE_M = 0.30  # feet higher than this above the floor are not on it
TOLERANCE_M = 0.02  # the floor is an estimate too


def ground_pairs(
    state: BodyState, ground: Ground, kernel: Kernel = geman_mcclure_weight
) -> Pairs:
    """Return where vertices below the floor and soles above it should go.

    Args:
        state: Body.
        ground: The floor.
        kernel: Robust weight of a sole's height: a step's, or the kernel's own to compare.
    """
    height = ground.height(state.vertices)
    share = _share(state)
    below = np.flatnonzero(height < -TOLERANCE_M)
    lifted = _on_floor(state, below, height, ground, np.full(len(below), BELOW_SIGMA_M**-2))
    parts = [_scaled(lifted, share)]
    contact = [height[sole].mean() for sole in state.body.soles]
    for sole, foot_height in zip(state.body.soles, contact, strict=True):
        # One foot carries the person; the other may be in the air.
        carries = 1.0 if foot_height <= min(contact) else 0.3
        weight = kernel(height[sole], CONTACT_SCALE_M) * carries
        pairs = _on_floor(state, sole, height, ground, weight / CONTACT_SIGMA_M**2)
        parts.append(_scaled(pairs, 4.0 / max(len(sole), 1)))
    return join_pairs(parts)


def _on_floor(
    state: BodyState,
    vertex: Int[np.ndarray, 'n'],
    height: Float[np.ndarray, 'v'],
    ground: Ground,
    weight: Float[np.ndarray, 'n'],
) -> Pairs:
    target = state.vertices[vertex] - height[vertex, None] * ground.normal
    return Pairs(vertex, np.tile(ground.normal, (len(vertex), 1)), target, weight)


def _scaled(pairs: Pairs, factor: float) -> Pairs:
    return Pairs(pairs.vertex, pairs.direction, pairs.target, pairs.weight * factor)


def _share(state: BodyState) -> float:
    """Return the weight of one vertex such that meshes of any density push alike."""
    return 100.0 / len(state.body.main_bone)
