"""What a picture needs to know of one person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.estimate import BodyEstimate
from pop_core.rendering.palette import person_color


@dataclass(frozen=True, slots=True, eq=False)
class ShownBody:
    """One person to draw, from an estimate, from the truth or from recorded messages.

    Args:
        vertices: Mesh [m], camera frame.
        joints: The 24 joints [m], camera frame.
        joint_state: A JointState per joint.
        mask: Pixels that show this person.
        id: Which person of a sequence this is, or None; colour and label follow it.
    """

    vertices: Float[np.ndarray, 'v 3']
    joints: Float[np.ndarray, '24 3']
    joint_state: Int[np.ndarray, '24']
    mask: Bool[np.ndarray, 'h w']
    id: int | None = None


def shown(body: BodyEstimate) -> ShownBody:
    """Return what a picture needs of an estimate."""
    person = None if body.track is None else body.track.id
    return ShownBody(body.vertices, body.joints, body.joint_state, body.mask, person)


def body_color(body: ShownBody, index: int) -> tuple[int, int, int]:
    """Return the colour of a person: that of the id, or of the place among those of the frame."""
    return person_color(index if body.id is None else body.id)
