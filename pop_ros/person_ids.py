"""One id per person: the track's, or where nobody is tracked, that of the nearest pelvis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment

from pop_core.estimate import BodyEstimate

MAX_STEP_M = 0.6  # a walking person between two frames of a slow pipeline


class PersonIds:
    """Ids of the people of the latest frame; an id is never given to a second person."""

    def __init__(self) -> None:
        self._ids: list[int] = []
        self._pelvis: Float[np.ndarray, 'n 3'] = np.zeros((0, 3))
        self._next_id = 0

    def of(self, bodies: Sequence[BodyEstimate]) -> list[int]:
        """Return the id of each body of the next frame."""
        tracks = [body.track for body in bodies if body.track is not None]
        if bodies and len(tracks) == len(bodies):
            return [track.id for track in tracks]
        return self.assign(np.array([body.joints[0] for body in bodies]).reshape(-1, 3))

    def assign(self, pelvis: Float[np.ndarray, 'n 3']) -> list[int]:
        """Return an id for each pelvis [m], keeping those of the latest frame where near."""
        ids = [-1] * len(pelvis)
        distance = np.linalg.norm(pelvis[:, None] - self._pelvis[None], axis=2)
        # The square keeps two people together in place of one far jump and one small step.
        rows, columns = linear_sum_assignment(np.minimum(distance, 2 * MAX_STEP_M) ** 2)
        for row, column in zip(rows, columns, strict=True):
            if distance[row, column] <= MAX_STEP_M:
                ids[row] = self._ids[column]
        for row, known in enumerate(ids):
            if known < 0:
                ids[row] = self._next_id
                self._next_id += 1
        self._ids, self._pelvis = ids, pelvis
        return ids
