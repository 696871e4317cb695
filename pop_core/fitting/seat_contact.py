"""Contact with seats: people who sit or lie on something rest on it and do not sink into it.

A seat is a level surface measured close to the pelvis and below it, above the floor: a chair, a
sofa, a bed. Who sits rests on buttocks and thighs, who lies on everything.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import JOINT_INDEX
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.ground_contact import (
    BELOW_SIGMA_M,
    CONTACT_SIGMA_M,
    TOLERANCE_M,
    onto_plane,
    uprightness,
)
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs, join_pairs
from pop_core.fitting.robust_loss import geman_mcclure_weight
from pop_core.segmentation.ground import Ground

LOWEST_M = 0.2  # above the floor: whoever rests lower, rests on the floor
UNDER_PELVIS_M = 0.04  # a seat lies at least this far below the pelvis joint
BESIDE_M = 0.5  # a seat is measured this near to the pelvis, seen from above
LAYER_M = 0.04  # thickness of a level surface as measured
FEWEST_PIXELS = 40
LEVEL_SHARE = 0.3  # of what is measured there: walls and legs of tables spread over all heights
LEVEL_THIGH = 0.5  # sine of the slope of a thigh on a seat
UPRIGHT = 0.6  # cosine between trunk and vertical of people who sit
CONTACT_SCALE_M = 0.1
RESTING_SHARE = 0.05  # of the resting skin that touches
SEATED_BONES = [JOINT_INDEX[name] for name in ('pelvis', 'left_hip', 'right_hip')]


def find_seat(
    state: BodyState, observation: Observation, segment: Bool[np.ndarray, 'h w']
) -> Ground | None:
    """Return the plane of the seat under a body, or None.

    Args:
        state: Body that may sit or lie.
        observation: With a floor: it tells what is level.
        segment: The person's own pixels.
    """
    ground = observation.ground
    if ground is None or not _rests(state, ground):
        return None
    points = observation.points(np.isfinite(observation.depth_m) & ~segment)
    pelvis = state.joints[:1]
    height, top = ground.height(points), float(ground.height(pelvis)[0]) - UNDER_PELVIS_M
    offset = points - pelvis
    aside2 = (offset**2).sum(axis=1) - (offset @ ground.normal) ** 2
    height = np.sort(height[(aside2 < BESIDE_M**2) & (height > LOWEST_M) & (height < top)])
    if len(height) < FEWEST_PIXELS:
        return None
    # The layer with the most pixels.
    end = np.searchsorted(height, height + LAYER_M)
    count = end - np.arange(len(height))
    first = int(np.argmax(count))
    if count[first] < max(FEWEST_PIXELS, LEVEL_SHARE * len(height)):
        return None
    level_m = float(np.median(height[first: end[first]]))
    return Ground(ground.normal, ground.offset_m - level_m)


def seat_pairs(state: BodyState, seat: Ground) -> Pairs:
    """Return where skin inside the seat should go, and the lowest of what rests on it.

    Args:
        state: Body.
        seat: Plane of the seat; heights count from it.
    """
    height = seat.height(state.vertices)
    resting = np.ones(len(height), dtype=bool)
    if uprightness(state, seat) > UPRIGHT:
        resting = np.isin(state.body.main_bone, SEATED_BONES)
    below = np.flatnonzero(resting & (height < -TOLERANCE_M))
    # Meshes of any density push alike.
    push = np.full(len(below), 100.0 / len(height) / BELOW_SIGMA_M**2)
    touching = _lowest(height, np.flatnonzero(resting))
    pull = geman_mcclure_weight(height[touching], CONTACT_SCALE_M)
    pull = pull / CONTACT_SIGMA_M**2 / len(touching)
    return join_pairs([
        onto_plane(state, below, seat, push), onto_plane(state, touching, seat, pull)])


def _rests(state: BodyState, ground: Ground) -> bool:
    """Return whether a body lies, or sits: thighs about level."""
    if uprightness(state, ground) < UPRIGHT:
        return True
    thighs = [
        state.joints[JOINT_INDEX[f'{side}_knee']] - state.joints[JOINT_INDEX[f'{side}_hip']]
        for side in ('left', 'right')]
    slope = [abs(thigh @ ground.normal) / np.linalg.norm(thigh) for thigh in thighs]
    return bool(max(slope) < LEVEL_THIGH)


def _lowest(
    height: Float[np.ndarray, 'v'], vertex: Int[np.ndarray, 'n']
) -> Int[np.ndarray, 'k']:
    count = max(1, round(RESTING_SHARE * len(vertex)))
    return vertex[np.argsort(height[vertex])[:count]]
