"""Two-bone limbs: from directions or a target to joint rotations, many poses at once.

A limb is told by the unit directions u of its first bone and v of its second. The hinge between
them fixes the turn of the first bone about itself, so hands and feet end where they should and
elbows and knees bend the way they do.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.geometry.rotation import from_rotvec

# Below this bend the two directions no longer tell the hinge, and the pole does.
STRAIGHT_RAD = 0.15
REACH = 0.985  # of the limb's length: fully stretched limbs lock their hinge


def normalised(vectors: Float[np.ndarray, '*n 3']) -> Float[np.ndarray, '*n 3']:
    """Return unit vectors."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-9))


def across(
    vectors: Float[np.ndarray, 'n 3'], axis: Float[np.ndarray, 'n 3']
) -> Float[np.ndarray, 'n 3']:
    """Return the unit part of vectors that is perpendicular to unit axes."""
    along = np.sum(vectors * axis, axis=1, keepdims=True)
    return normalised(vectors - along * axis)


def two_bone_directions(
    reach: Float[np.ndarray, 'n 3'], lengths: tuple[float, float], pole: Float[np.ndarray, 'n 3']
) -> tuple[Float[np.ndarray, 'n 3'], Float[np.ndarray, 'n 3']]:
    """Return the bones' directions that carry a limb's end to a place.

    Args:
        reach: Wanted end relative to the limb's root [m]; shortened or lengthened to what the
            limb can reach.
        lengths: Lengths of the two bones [m].
        pole: Direction in which the middle joint points.

    Returns:
        Unit directions of the first and the second bone.
    """
    first, second = lengths
    distance = np.linalg.norm(reach, axis=1, keepdims=True)
    e = reach / np.maximum(distance, 1e-9)
    distance = np.clip(distance, 0.3 * (first + second), REACH * (first + second))
    along = (first**2 - second**2 + distance**2) / (2.0 * distance)
    out = np.sqrt(np.maximum(first**2 - along**2, 0.0))
    middle = along * e + out * across(pole, e)
    return middle / first, normalised(distance * e - middle)


def hinge_angle(
    u: Float[np.ndarray, 'n 3'], v: Float[np.ndarray, 'n 3']
) -> Float[np.ndarray, 'n']:
    """Return the angle between the bones [rad], zero for a straight limb."""
    sine = np.linalg.norm(np.cross(u, v), axis=1)
    return np.asarray(np.arctan2(sine, np.sum(u * v, axis=1)))


def leg_rotation(
    u: Float[np.ndarray, 'n 3'], v: Float[np.ndarray, 'n 3'], knee_pole: Float[np.ndarray, 'n 3']
) -> tuple[Float[np.ndarray, 'n 3 3'], Float[np.ndarray, 'n 3']]:
    """Return the thigh's rotation (outer frame) and the knee's rotation vector [rad].

    A leg hangs along -y at rest, and its knee bends the shin towards -z by a turn about +x.
    """
    angle = hinge_angle(u, v)
    back = _bend_direction(u, v, angle, -knee_pole)
    R = np.stack([np.cross(u, back), -u, -back], axis=2)
    return R, angle[:, None] * np.array([1.0, 0.0, 0.0])


def arm_rotation(
    u: Float[np.ndarray, 'n 3'],
    v: Float[np.ndarray, 'n 3'],
    elbow_pole: Float[np.ndarray, 'n 3'],
    sign: float,
) -> tuple[Float[np.ndarray, 'n 3 3'], Float[np.ndarray, 'n 3']]:
    """Return the upper arm's rotation (outer frame) and the elbow's rotation vector [rad].

    A left arm (sign +1) points along +x at rest, a right one (-1) along -x; both elbows bend the
    forearm towards +z.
    """
    angle = hinge_angle(u, v)
    front = _bend_direction(u, v, angle, -elbow_pole)
    bone = sign * u
    R = np.stack([bone, np.cross(front, bone), front], axis=2)
    return R, -sign * angle[:, None] * np.array([0.0, 1.0, 0.0])


def turned(
    vectors: Float[np.ndarray, 'n 3'], rotvec: Float[np.ndarray, 'n 3']
) -> Float[np.ndarray, 'n 3']:
    """Return vectors turned by rotation vectors [rad]."""
    return np.einsum('nrc,nc->nr', from_rotvec(rotvec), vectors)


def _bend_direction(
    u: Float[np.ndarray, 'n 3'],
    v: Float[np.ndarray, 'n 3'],
    angle: Float[np.ndarray, 'n'],
    fallback: Float[np.ndarray, 'n 3'],
) -> Float[np.ndarray, 'n 3']:
    """Return the unit direction, across u, to which the second bone leaves the first."""
    bent = across(v, u)
    straight = across(fallback, u)
    trust = np.clip(angle / STRAIGHT_RAD - 0.5, 0.0, 1.0)[:, None]
    return across(trust * bent + (1.0 - trust) * straight, u)
