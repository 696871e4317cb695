"""Robust kernels as weights of iteratively reweighted least squares."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def geman_mcclure_weight(
    distance: Float[np.ndarray, 'n'], scale: float
) -> Float[np.ndarray, 'n']:
    """Return weights (c^2 / (c^2 + d^2))^2 of residual lengths (Geman and McClure 1987).

    The kernel is concave in d^2, so a step that lowers the weighted quadratic lowers the kernel.

    Args:
        distance: Residual lengths, same unit as `scale`.
        scale: Length c at which a residual keeps a quarter of its weight.
    """
    squared = scale * scale
    return (squared / (squared + distance * distance)) ** 2


def huber_weight(distance: Float[np.ndarray, 'n'], scale: float) -> Float[np.ndarray, 'n']:
    """Return weights min(1, c / d) of residual lengths (Huber 1964)."""
    return scale / np.maximum(np.abs(distance), scale)
