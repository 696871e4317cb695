"""Things that people carry: they change outlines and hide hands, as they do for real sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.synthesis.blocks import Block, box, ellipsoid
from pop_core.synthesis.rooms import any_colour

STRAP_M = 0.16  # from the hand down to the middle of a bag
BACK_M = 0.05   # from the chest's joint to the skin of the back


def draw_prop(
    model: BodyModel, parameters: BodyParameters, rng: np.random.Generator
) -> Block:
    """Return a bag hanging from a hand, something held, or a backpack (room frame, [m])."""
    skeleton = pose_skeleton(model, parameters)
    p = parameters.scale * skeleton.p + parameters.transl
    hand = p[JOINT_INDEX['left_hand' if rng.random() < 0.5 else 'right_hand']]
    kind = rng.integers(3)
    if kind == 0:
        return _around(hand - [0.0, STRAP_M, 0.0], rng.uniform([0.2, 0.22, 0.1], [0.4, 0.3, 0.2]),
                       rng)
    if kind == 1:
        return _around(hand, rng.uniform(0.06, 0.3, 3), rng)
    chest = JOINT_INDEX['spine3']
    size_m = rng.uniform([0.25, 0.35, 0.15], [0.35, 0.5, 0.25])
    away = skeleton.G[chest] @ np.array([0.0, 0.0, -1.0])
    pack = _around(p[chest] + away * (BACK_M + size_m[2] / 2), size_m, rng)
    return replace(pack, yaw_rad=float(np.arctan2(-away[0], -away[2])))


def _around(
    middle: Float[np.ndarray, '3'], size_m: Float[np.ndarray, '3'], rng: np.random.Generator
) -> Block:
    base = middle - np.array([0.0, size_m[1] / 2, 0.0])
    base[1] = max(float(base[1]), 0.0)
    make = box if rng.random() < 0.4 else ellipsoid
    return make(size_m.tolist(), base.tolist(), any_colour(rng))
