"""Robust kernels as weights of iteratively reweighted least squares."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

Kernel = Callable[[Float[np.ndarray, 'n'], float], Float[np.ndarray, 'n']]


def geman_mcclure_weight(
    distance: Float[np.ndarray, 'n'], scale: float
) -> Float[np.ndarray, 'n']:
    """Return step weights (c^2 / (c^2 + d^2))^2 of residual lengths (Geman and McClure 1987).

    The kernel is concave in d^2, so a step that lowers the weighted quadratic lowers the kernel.

    Args:
        distance: Residual lengths, same unit as `scale`.
        scale: Length c at which a residual keeps a quarter of its weight.
    """
    return geman_mcclure_share(distance, scale) ** 2


def geman_mcclure_share(
    distance: Float[np.ndarray, 'n'], scale: float
) -> Float[np.ndarray, 'n']:
    """Return c^2 / (c^2 + d^2): the share of d^2 that the kernel itself costs.

    Hypotheses are compared by the kernel: by step weights a joint that is far off would cost less
    the farther off it is.
    """
    squared = scale * scale
    return squared / (squared + distance * distance)
