"""Keypoints over time: a detector's errors last for some frames and then change.

Independent errors in every frame would flatter any method that averages over time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr

from pop_core.body.joints import N_SHARED
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.synthesis.keypoints import KeypointDraws, KeypointNoise, detection_from_draws
from pop_core.synthesis.truth import PersonTruth

LASTING_S = 0.3     # after this time an error is forgotten to a share of 1/e
FRESH_SHARE = 0.3   # of the variance that is new in every frame
FEWEST_SEEN = 2
N_NUMBERS = 9 * N_SHARED


class KeypointStream:
    """A detector that watches a recording; everybody gets errors of their own."""

    def __init__(self, noise: KeypointNoise, rate_hz: float, rng: np.random.Generator) -> None:
        """Take the size of errors and the rate of the recording."""
        self._noise, self._rng = noise, rng
        self._keep = float(np.exp(-1.0 / (LASTING_S * rate_hz)))
        self._lasting: Float[np.ndarray, 'p n'] | None = None

    def detect(
        self, people: Sequence[PersonTruth], camera: Camera
    ) -> tuple[Detection | None, ...]:
        """Return what the detector finds of each person of the next frame."""
        fresh, own = self._rng.normal(size=(2, len(people), N_NUMBERS))
        if self._lasting is None:
            self._lasting = fresh
        else:
            # A stationary process of first order keeps unit variance (AR(1)).
            self._lasting = self._keep * self._lasting + np.sqrt(1 - self._keep**2) * fresh
        mixed = np.sqrt(1 - FRESH_SHARE) * self._lasting + np.sqrt(FRESH_SHARE) * own
        return tuple(
            self._detect(person, camera, draws_from_normals(row))
            for person, row in zip(people, mixed, strict=True))

    def _detect(
        self, person: PersonTruth, camera: Camera, draws: KeypointDraws
    ) -> Detection | None:
        if (person.shared_state == JointState.VISIBLE).sum() < FEWEST_SEEN:
            return None  # guesses alone make nobody
        return detection_from_draws(
            person.shared_points, person.shared_state, camera, draws, self._noise)


def draws_from_normals(row: Float[np.ndarray, 'n']) -> KeypointDraws:
    """Return the numbers of a detection from normally distributed ones."""
    n = N_SHARED
    normal = row.reshape(9, n)
    # The distribution function makes them uniform.
    uniform = ndtr(normal)
    return KeypointDraws(
        guess=uniform[0], missing=uniform[1], outlier=uniform[2],
        elsewhere=uniform[3:5].reshape(n, 2), spread=float(uniform[5, 0]),
        swap=float(uniform[5, 1]), offset=normal[6:8].reshape(n, 2), high=normal[8], low=normal[8])
