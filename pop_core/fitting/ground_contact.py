"""Contact with the floor: bodies stand on it, never below it.

The floor tells what a hidden leg does: where the pelvis is high, the person stands, where it is
low, they sit or crouch. Unseen feet of upright people are drawn to the floor, softly, since people
also climb and sit on high chairs; standing below the floor is forbidden.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.residuals import Pairs
from pop_core.fitting.robust_loss import Kernel, geman_mcclure_weight
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.segmentation.ground import Ground

BELOW_SIGMA_M = 0.01
CONTACT_SIGMA_M = 0.03
CONTACT_SCALE_M = 0.30  # feet higher than this above the floor are not on it
TOLERANCE_M = 0.02  # the floor is an estimate too
ANKLES = (SHARED_INDEX['left_ankle'], SHARED_INDEX['right_ankle'])


def ground_pairs(
    state: BodyState,
    ground: Ground,
    lifted: LiftedJoints,
    kernel: Kernel = geman_mcclure_weight,
) -> Pairs:
    """Return where vertices below the floor and unseen soles above it should go.

    Args:
        state: Body.
        ground: The floor.
        lifted: Tells which feet are seen: those stand where they are seen.
        kernel: Robust weight of a sole's height: a step's, or the kernel's own to compare.
    """
    height = ground.height(state.vertices)
    below = np.flatnonzero(height < -TOLERANCE_M)
    # Meshes of any density push alike.
    weight = np.full(len(below), 100.0 / len(height) / BELOW_SIGMA_M**2)
    vertices, weights = [below], [weight]
    contact = [height[sole].mean() for sole in state.body.soles]
    upright = min(max(2.0 * uprightness(state, ground) - 0.5, 0.0), 1.0)
    for ankle, sole, foot_height in zip(ANKLES, state.body.soles, contact, strict=True):
        if lifted.lifted[ankle]:
            continue
        # One foot carries the person; the other may be in the air.
        carries = 1.0 if foot_height <= min(contact) else 0.3
        worth = 4.0 * upright * carries / CONTACT_SIGMA_M**2 / len(sole)
        vertices.append(sole)
        weights.append(worth * kernel(height[sole], CONTACT_SCALE_M))
    return onto_plane(state, np.concatenate(vertices), ground, np.concatenate(weights))


def uprightness(state: BodyState, ground: Ground) -> float:
    """Return the cosine between the trunk and the floor's normal: people who lie do not stand."""
    trunk = state.joints[JOINT_INDEX['neck']] - state.joints[JOINT_INDEX['pelvis']]
    return float(trunk @ ground.normal / np.linalg.norm(trunk))


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
