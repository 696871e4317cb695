"""A limb of two bones whose end is put onto a target: shared by arms and legs."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

MAX_STRETCH = 0.985  # of the straight limb: a locked elbow or knee has no hinge plane
CLOSEST_M = 0.12     # flesh stops a limb from folding further


def bend(
    target: Float[np.ndarray, '3'], aside: Float[np.ndarray, '3'], upper_m: float, lower_m: float
) -> tuple[Float[np.ndarray, '3'], Float[np.ndarray, '3']]:
    """Return unit directions of the upper and lower bone (law of cosines).

    Args:
        target: Where the limb ends, from where it begins [m]; brought nearer when out of reach.
        aside: Direction into which elbow or knee points.
        upper_m: Length of the upper bone [m].
        lower_m: Length of the lower bone [m].
    """
    shortest = abs(upper_m - lower_m) + CLOSEST_M
    length = float(np.linalg.norm(target))
    distance = float(np.clip(length, shortest, MAX_STRETCH * (upper_m + lower_m)))
    along = target / max(length, 1e-9)
    across = aside - (aside @ along) * along
    across = across / max(float(np.linalg.norm(across)), 1e-9)
    cosine = (upper_m**2 + distance**2 - lower_m**2) / (2 * upper_m * distance)
    cosine = float(np.clip(cosine, -1.0, 1.0))
    upper = along * cosine + across * np.sqrt(1.0 - cosine**2)
    lower = along * distance - upper * upper_m
    return upper, lower / np.linalg.norm(lower)


def bone_frame(
    bone: Float[np.ndarray, '3'], hinge: Float[np.ndarray, '3']
) -> Float[np.ndarray, '3 3']:
    """Return columns (bone, hinge made square to it, bone x hinge), all of unit length."""
    along = bone / max(float(np.linalg.norm(bone)), 1e-9)
    square = hinge - (hinge @ along) * along
    square = square / max(float(np.linalg.norm(square)), 1e-9)
    return np.column_stack([along, square, np.cross(along, square)])
