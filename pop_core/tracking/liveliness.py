"""How lively the parts of a person are: who stands still is expected to go on doing so.

A part is compared with its own past, a mean that forgets within a moment. The velocity noise of
one that has hardly left it falls, so that noise of the sensor is averaged over many frames; one
that moves, or that nobody sees, gets all of it.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import JOINT_NAMES, N_JOINTS, PARENTS
from pop_core.estimate import JointState

TRAIL_S = 0.15  # how fast the past is forgotten
TURN_RAD, SHIFT_M = 0.04, 0.016  # away from its past, a part moves; sensors shake by less
SHORT_M, TIP_M = 0.15, 0.3  # noise of the ends of a short bone turns it far, a hand most
LEAST = 0.03  # of the velocity noise: nobody is a statue


def _own_bones() -> Bool[np.ndarray, '24 24']:
    """Return which bones, named by their lower ends, hang on each joint.

    A joint at the end of a limb turns as its parent does, as far as anybody can tell.
    """
    own = np.zeros((N_JOINTS, N_JOINTS), dtype=bool)
    own[PARENTS[1:], range(1, N_JOINTS)] = True
    ends = ~own.any(axis=1)
    own[ends] = np.eye(N_JOINTS, dtype=bool)[ends]
    return own


OWN = _own_bones()
LEAST_LENGTH_M = np.array([
    TIP_M if name.endswith(('hand', 'foot')) else SHORT_M for name in JOINT_NAMES])
# A turn about a bone moves only what follows.
SHOWN_BY = OWN | (OWN.astype(np.int64) @ OWN > 0)


def followed_trail(
    trail: Float[np.ndarray, '24 3'], joints: Float[np.ndarray, '24 3'], gap_s: float
) -> Float[np.ndarray, '24 3']:
    """Return the past of joints after a time step [s]: where they were of late [m]."""
    return trail + (1.0 - np.exp(-gap_s / TRAIL_S)) * (joints - trail)


def liveliness(
    joints: Float[np.ndarray, '24 3'], trail: Float[np.ndarray, '24 3'],
    joint_state: Int[np.ndarray, '24'],
) -> Float[np.ndarray, '75']:
    """Return the share of the usual velocity noise of each coordinate, LEAST to 1.

    Args:
        joints: Joints, camera frame [m].
        trail: Where they were of late [m].
        joint_state: A JointState per joint.
    """
    left, start = joints - trail, np.maximum(PARENTS, 0)
    length = np.maximum(np.linalg.norm(joints - joints[start], axis=1), LEAST_LENGTH_M)
    of_bone = np.linalg.norm(left - left[start], axis=1) / length / TURN_RAD
    seen = joint_state == JointState.VISIBLE
    turned = np.where(SHOWN_BY & seen, of_bone, 0.0).max(axis=1)
    turned[~(OWN & seen).any(axis=1)] = 1.0
    shifted = np.linalg.norm(left[0]) / SHIFT_M if seen[0] else 1.0
    return np.repeat(np.clip(np.append(shifted, turned) ** 2, LEAST, 1.0), 3)
