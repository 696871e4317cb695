"""Agreement of a fitted body with the depth of its pixels."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float32

from pop_core.rendering.depth_renderer import RenderedDepth

SUPPORT_M = 0.08  # measured and rendered depth agree within clothes and a small misfit


def depth_support(
    depth_m: Float32[np.ndarray, 'h w'], rendered: RenderedDepth, own: Bool[np.ndarray, 'h w']
) -> float:
    """Return the share of the body in view that measured depth agrees with.

    Args:
        depth_m: Measured depth [m].
        rendered: Depth image of the body alone.
        own: Pixels that may show this person.
    """
    with np.errstate(invalid='ignore'):
        in_view = own & rendered.covered & ~(depth_m < rendered.depth_m - SUPPORT_M)
        agrees = in_view & (np.abs(depth_m - rendered.depth_m) < SUPPORT_M)
    return float(agrees.sum() / max(int(in_view.sum()), 1))
