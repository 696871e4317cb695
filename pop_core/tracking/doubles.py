"""Two tracks of one person: one that began on a wall, say, may end on somebody followed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from pop_core.estimate import BodyEstimate

ONE_PLACE_M = 0.15  # mean distance of joints; people who embrace have their left sides apart


def doubles(bodies: Sequence[BodyEstimate]) -> set[int]:
    """Return the tracks that stand where an older one does: two people do not share one place.

    Args:
        bodies: The people of a frame, each with their track.
    """
    out: set[int] = set()
    known = [(body.track.id, body.joints) for body in bodies if body.track is not None]
    for (one, joints), (other, others) in combinations(known, 2):
        apart_m = np.linalg.norm(joints - others, axis=1).mean()
        if apart_m < ONE_PLACE_M:
            out.add(max(one, other))
    return out
