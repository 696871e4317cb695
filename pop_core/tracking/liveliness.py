"""How lively the parts of a person are: who stands still is expected to go on doing so.

A part is compared with its own past, a mean that forgets within a moment. The velocity noise of
one that has hardly left it falls, so that noise of the sensor is averaged over many frames; one
that moves, or that nobody sees, gets all of it.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.joints import JOINT_INDEX, N_JOINTS, PARENTS
from pop_core.estimate import JointState

TRAIL_S = 0.15  # how fast the past is forgotten
TURN_RAD, SHIFT_M = 0.04, 0.016  # away from its past, a part moves; sensors shake by less
SHORT_M = 0.15  # noise of the ends of a short bone turns it far
LEAST = 0.03  # of the velocity noise: nobody is a statue


def _next_joint() -> Int[np.ndarray, '24']:
    """Return the joint that shows each joint's rotation; the last of a limb shows its parent's."""
    out = np.arange(N_JOINTS)
    for child in reversed(range(1, N_JOINTS)):
        out[PARENTS[child]] = child
    out[[0, JOINT_INDEX['spine3']]] = JOINT_INDEX['spine1'], JOINT_INDEX['neck']
    return out


NEXT = _next_joint()
# A joint at the end of a limb turns as its parent does, as far as anybody can tell.
BASE = np.where(NEXT == np.arange(N_JOINTS), np.array(PARENTS), np.arange(N_JOINTS))


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
    left = joints - trail
    bone = joints[NEXT] - joints[BASE]
    length = np.maximum(np.linalg.norm(bone, axis=1), SHORT_M)
    turned = np.linalg.norm(left[NEXT] - left[BASE], axis=1) / length / TURN_RAD
    shifted = np.linalg.norm(left[0]) / SHIFT_M
    unseen = joint_state != JointState.VISIBLE
    moved = np.append(shifted, turned)
    moved[np.append(unseen[0], unseen[NEXT])] = 1.0
    return np.repeat(np.clip(moved**2, LEAST, 1.0), 3)
