"""What a picture needs to know of one person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.estimate import BodyEstimate


@dataclass(frozen=True, slots=True, eq=False)
class ShownBody:
    """One person to draw, from an estimate, from the truth or from recorded messages.

    Args:
        vertices: Mesh [m], camera frame.
        joints: The 24 joints [m], camera frame.
        joint_state: A JointState per joint.
        mask: Pixels that show this person.
    """

    vertices: Float[np.ndarray, 'v 3']
    joints: Float[np.ndarray, '24 3']
    joint_state: Int[np.ndarray, '24']
    mask: Bool[np.ndarray, 'h w']


def shown(body: BodyEstimate) -> ShownBody:
    """Return what a picture needs of an estimate."""
    return ShownBody(body.vertices, body.joints, body.joint_state, body.mask)
