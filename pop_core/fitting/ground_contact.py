"""Contact with the floor: bodies stand on it, never below it.

The floor tells what a hidden leg does: where the pelvis is high, the person stands, where it is
low, they sit or crouch. Unseen feet of upright people are drawn to the floor, softly, since people
also climb and sit on high chairs; standing below the floor is forbidden.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.ground_kernels import contact
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs
from pop_core.fitting.robust_loss import Power
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.segmentation.ground import Ground

BELOW_SIGMA_M = 0.01
CONTACT_SIGMA_M = 0.03
CONTACT_SCALE_M = 0.30  # feet higher than this above the floor are not on it
TOLERANCE_M = 0.02  # the floor is an estimate too
BELOW_WEIGHT, FOOT_WEIGHT = 100.0, 4.0  # of a whole body below the floor, of a sole above it
LIFTED_SHARE = 0.3  # one foot carries the person; the other may be in the air
ANKLES = [SHARED_INDEX['left_ankle'], SHARED_INDEX['right_ankle']]
NO_FEET = np.zeros(2, dtype=bool)
IN_FLESH_M = (-0.12, 0.03)  # measured surface before and behind an ankle that it is the skin of


def ground_pairs(
    state: BodyState,
    ground: Ground,
    lifted: LiftedJoints,
    power: Power = Power.STEP,
    measured: Bool[np.ndarray, '2'] = NO_FEET,
) -> Pairs:
    """Return where vertices below the floor and unseen soles above it should go.

    Args:
        state: Body.
        ground: The floor.
        lifted: Tells which feet are seen: those stand where they are seen.
        power: Of the robust share of a sole's height: a step's, or that bodies are compared by.
        measured: Left and right foot: those that stand where something was measured, named or
            not, are seen as well.
    """
    upright = min(max(2.0 * uprightness(state, ground) - 0.5, 0.0), 1.0)
    unseen = np.isnan(lifted.positions_camera[ANKLES, 0]) & ~measured
    foot_weight = np.where(unseen, FOOT_WEIGHT * upright / CONTACT_SIGMA_M**2, -1.0)
    # Meshes of any density push alike.
    below_weight = BELOW_WEIGHT / len(state.vertices) / BELOW_SIGMA_M**2
    return Pairs(*contact(
        state.vertices, ground.normal, ground.offset_m, TOLERANCE_M, below_weight,
        *state.body.soles, foot_weight, LIFTED_SHARE, CONTACT_SCALE_M, int(power)))


def measured_feet(
    state: BodyState, observation: Observation
) -> Bool[np.ndarray, '2']:
    """Return whether the left and right ankle lie under surface that stands clear of the body.

    A kicking leg whose keypoints were missed hangs in the air, and the camera sees that it does.
    """
    clear = observation.standing_clear
    if clear is None:
        return NO_FEET
    ankles = state.landmarks[ANKLES]
    measured_m, uv = observation.depth_at(ankles)
    gap_m = measured_m - ankles[:, 2]
    with np.errstate(invalid='ignore'):
        near = (gap_m > IN_FLESH_M[0]) & (gap_m < IN_FLESH_M[1])
    u, v = np.where(near[:, None], uv, 0).T
    return np.asarray(near & clear[v, u])


def uprightness(state: BodyState, ground: Ground) -> float:
    """Return the cosine between the trunk and the floor's normal: people who lie do not stand."""
    p = state.skeleton.p
    trunk = p[JOINT_INDEX['neck']] - p[JOINT_INDEX['pelvis']]
    return float(trunk @ ground.normal) / math.sqrt(trunk @ trunk)


def onto_plane(
    state: BodyState,
    vertex: Int[np.ndarray, 'n'],
    plane: Ground,
    weight: Float[np.ndarray, 'n'],
) -> Pairs:
    """Return pairs that draw vertices onto a plane, along its normal."""
    points = state.vertices[vertex]
    target = points - plane.height(points)[:, None] * plane.normal
    return Pairs(vertex, np.broadcast_to(plane.normal, target.shape), target, weight)
