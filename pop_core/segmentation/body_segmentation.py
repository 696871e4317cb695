"""Segmentation of the human in the depth image by the rendered body (step 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32

from pop_core.depth_noise import BASE_M, DepthNoise
from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.segmentation import growth_kernels
from pop_core.settings import setting

NEAREST_M = 0.3  # people are not nearer
SIGMAS = 3.0  # of noise that are no step


@dataclass(frozen=True, slots=True)
class SegmentationConfig:
    """How the human is cut out of the depth image."""

    gamma_m: float = setting(
        0.03, unit='m', minimum=0.005, maximum=0.2,
        about="Depth step between neighbouring pixels that still counts as one surface, the "
        "paper's gamma, beside noise.")
    tolerance_m: float = setting(
        0.10, unit='m', minimum=0.02, maximum=0.5,
        about='Distance between measured and rendered depth, beside noise, up to which a pixel is '
        'the body.')
    growth_m: float = setting(
        0.04, unit='m', minimum=0.0, maximum=0.3,
        about='How far the segment may grow beyond the rendered silhouette: clothes and hair.')


def segment_body(
    depth_m: Float32[np.ndarray, 'h w'],
    rendered: RenderedDepth,
    own: Bool[np.ndarray, 'h w'],
    focal_px: float,
    config: SegmentationConfig,
    noise: DepthNoise,
) -> Bool[np.ndarray, 'h w']:
    """Return the pixels that show the person: the mask of clean depth and of H (step 6).

    The rendered body is a mask; pixels around it join when their depth is within gamma of a
    neighbour already inside. Growth stays within `growth_m` of the silhouette and `tolerance_m`
    of the depth of the nearest rendered pixel, so that it cannot run along a seat or a floor. Far
    from a sensor that triangulates, neighbours on one surface differ by more than gamma: noise
    counts beside it.

    Args:
        depth_m: Measured depth D_in [m].
        rendered: Rendered depth of the body, D(beta, theta).
        own: Pixels that may show this person.
        focal_px: Focal length [px], which turns `growth_m` into pixels.
        config: Thresholds.
        noise: Noise of the measured depth.
    """
    out = np.zeros(depth_m.shape, dtype=bool)
    growth_kernels.segment(
        np.ascontiguousarray(depth_m), np.ascontiguousarray(rendered.depth_m),
        np.ascontiguousarray(own), config.gamma_m, config.tolerance_m,
        SIGMAS * BASE_M, SIGMAS * noise.per_m, config.growth_m * focal_px, NEAREST_M, out)
    return out


def with_holes(
    segment: Bool[np.ndarray, 'h w'],
    unmeasured: Bool[np.ndarray, 'h w'],
    rendered: RenderedDepth,
) -> Bool[np.ndarray, 'h w']:
    """Return a segment with the holes that dark hair and cloth leave in depth.

    A hole is the person's where the body covers it and it touches what was measured of them.

    Args:
        segment: Measured pixels that show the person.
        unmeasured: Pixels without depth that nobody else explains.
        rendered: Rendered depth of the body.
    """
    holes = unmeasured & rendered.covered
    if not holes.any():
        return segment
    together = segment.copy()
    growth_kernels.flood(together, holes)
    return together
