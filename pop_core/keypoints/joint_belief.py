"""What is believed of the joints of one person before a body is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import SHARED_MIRROR


@dataclass(frozen=True, slots=True, eq=False)
class JointBelief:
    """Where every one of the 15 shared joints is, seen or hidden.

    Args:
        positions_camera: Expected joint centres, camera frame [m].
        sigma_m: Standard deviation of each along any axis [m].
    """

    positions_camera: Float[np.ndarray, 's 3']
    sigma_m: Float[np.ndarray, 's']

    @property
    def vagueness(self) -> float:
        """Return the mean logarithm of the standard deviations."""
        return float(np.log(self.sigma_m).mean())

    def with_sides_exchanged(self) -> JointBelief:
        """Return the belief with every left joint called right, and vice versa."""
        return JointBelief(self.positions_camera[SHARED_MIRROR], self.sigma_m[SHARED_MIRROR])
