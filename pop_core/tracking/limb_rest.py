"""When a limb that was looked for in vain is looked for again: later and later.

A search costs more than following the whole person, and what a search did not find in one image
is seldom found in the next.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import N_JOINTS

Tried = tuple[Bool[np.ndarray, '24'], bool]  # joints of a limb, and whether it was found
FIRST_REST_S, LONGEST_REST_S = 0.1, 0.8


def _awake() -> Int[np.ndarray, '24']:
    return np.zeros(N_JOINTS, dtype=np.int64)


def _rested() -> Float[np.ndarray, '24']:
    return np.full(N_JOINTS, FIRST_REST_S)


@dataclass(slots=True, eq=False)
class LimbRests:
    """How long the joints of one person are not looked for.

    Args:
        until_ns: The time from which each joint is looked for again.
        rest_s: How long each rests once it is looked for in vain [s].
    """

    until_ns: Int[np.ndarray, '24'] = field(default_factory=_awake)
    rest_s: Float[np.ndarray, '24'] = field(default_factory=_rested)

    def resting(self, now_ns: int) -> Bool[np.ndarray, '24']:
        """Return the joints that are not looked for."""
        return self.until_ns > now_ns

    def note(self, tried: Iterable[Tried], now_ns: int) -> None:
        """Note which limbs were looked for, in order, and whether each was found."""
        for limb, is_found in tried:
            if is_found:
                self.found(limb)
            else:
                self.missed(limb, now_ns)

    def found(self, limb: Bool[np.ndarray, '24']) -> None:
        """Note that a limb was found: should it be lost again, it is looked for at once."""
        self.until_ns[limb], self.rest_s[limb] = 0, FIRST_REST_S

    def missed(self, limb: Bool[np.ndarray, '24'], now_ns: int) -> None:
        """Note that a limb was looked for in vain; it rests twice as long the next time."""
        self.until_ns[limb] = now_ns + (self.rest_s[limb] * 1e9).astype(np.int64)
        self.rest_s[limb] = np.minimum(2.0 * self.rest_s[limb], LONGEST_REST_S)
