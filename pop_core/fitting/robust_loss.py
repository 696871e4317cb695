"""Robust kernels as weights of iteratively reweighted least squares.

A residual of length d keeps the share c^2 / (c^2 + d^2) of its cost (Geman and McClure 1987).
Bodies are compared by that share itself: by the weights of steps, a joint that is far off would
cost less the farther off it is. Steps take its square: the kernel is concave in d^2, so a step
that lowers the weighted quadratic lowers the kernel.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from jaxtyping import Float


class Power(IntEnum):
    """Of the share: what weighs residuals where bodies are compared, and in a step."""

    COMPARED = 1
    STEP = 2


def geman_mcclure_weight(
    distance: Float[np.ndarray, 'n'], scale: float
) -> Float[np.ndarray, 'n']:
    """Return step weights (c^2 / (c^2 + d^2))^2 of residual lengths.

    Args:
        distance: Residual lengths, same unit as `scale`.
        scale: Length c at which a residual keeps a quarter of its weight.
    """
    return geman_mcclure_share(distance, scale) ** Power.STEP


def geman_mcclure_share(
    distance: Float[np.ndarray, 'n'], scale: float
) -> Float[np.ndarray, 'n']:
    """Return c^2 / (c^2 + d^2): the share of d^2 that the kernel itself costs."""
    squared = scale * scale
    return squared / (squared + distance * distance)
