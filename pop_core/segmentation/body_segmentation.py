"""Segmentation of the human in the depth image by the rendered body (step 6)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.segmentation import growth_kernels
from pop_core.settings import setting

NEAREST_M = 0.3  # people are not nearer


@dataclass(frozen=True, slots=True)
class SegmentationConfig:
    """How the human is cut out of the depth image."""

    gamma_m: float = setting(
        0.03, unit='m', minimum=0.005, maximum=0.2,
        about="Depth step between neighbouring pixels that still counts as one surface, the "
        "paper's gamma.")
    tolerance_m: float = setting(
        0.10, unit='m', minimum=0.02, maximum=0.5,
        about='Distance between measured and rendered depth up to which a pixel is the body.')
    growth_m: float = setting(
        0.06, unit='m', minimum=0.0, maximum=0.3,
        about='How far the segment may grow beyond the rendered silhouette: clothes and hair.')


def segment_body(
    depth_m: Float32[np.ndarray, 'h w'],
    rendered: RenderedDepth,
    own: Bool[np.ndarray, 'h w'],
    focal_px: float,
    config: SegmentationConfig,
) -> Bool[np.ndarray, 'h w']:
    """Return the pixels that show the person: the mask of clean depth and of H (step 6).

    The rendered body is a mask; pixels around it join when their depth is within gamma of a
    neighbour already inside. Growth stays within `growth_m` of the silhouette and `tolerance_m`
    of the depth of the nearest rendered pixel, so that it cannot run along a seat or a floor.

    Args:
        depth_m: Measured depth D_in [m].
        rendered: Rendered depth of the body, D(beta, theta).
        own: Pixels that may show this person.
        focal_px: Focal length [px], which turns `growth_m` into pixels.
        config: Thresholds.
    """
    out = np.zeros(depth_m.shape, dtype=bool)
    near = _near(rendered, config.growth_m * focal_px)
    if near is None:
        return out
    rendered = RenderedDepth(rendered.depth_m[near], rendered.face[near])
    covered, own = rendered.covered, own[near]
    depth_m = np.ascontiguousarray(depth_m[near])
    distance_px, extended_m = _extend(rendered)
    with np.errstate(invalid='ignore'):
        similar = own & (np.abs(depth_m - extended_m) < config.tolerance_m)
    segment = similar & covered
    reach_px = config.growth_m * focal_px / np.maximum(extended_m, NEAREST_M)
    allowed = similar & (distance_px <= reach_px)
    growth_kernels.grow(segment, allowed, depth_m, config.gamma_m)
    out[near] = segment
    return out


def _near(rendered: RenderedDepth, growth: float) -> tuple[slice, slice] | None:
    """Return the part of an image that a body's segment can reach; None where no body is.

    Args:
        rendered: Rendered depth of the body.
        growth: How far the segment may grow [m px]: over depth, a number of pixels.
    """
    covered = rendered.covered
    v, u = np.flatnonzero(covered.any(axis=1)), np.flatnonzero(covered.any(axis=0))
    if len(v) == 0:
        return None
    reach_px = int(growth / max(float(rendered.depth_m.min()), NEAREST_M)) + 1
    return (slice(max(v[0] - reach_px, 0), v[-1] + reach_px + 1),
            slice(max(u[0] - reach_px, 0), u[-1] + reach_px + 1))


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
    together = segment | holes
    count, label = cv2.connectedComponents(together.astype(np.uint8), connectivity=4)
    touching = np.zeros(count, dtype=bool)
    touching[label[segment]] = True
    return np.asarray(together & touching[label])


def _extend(
    rendered: RenderedDepth,
) -> tuple[Float32[np.ndarray, 'h w'], Float32[np.ndarray, 'h w']]:
    """Return the distance to the silhouette [px] and the depth of its nearest pixel [m]."""
    covered = rendered.covered
    distance, label = cv2.distanceTransformWithLabels(
        (~covered).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    depth_of_label = np.zeros(int(label.max()) + 1, dtype=np.float32)
    depth_of_label[label[covered]] = rendered.depth_m[covered]
    return distance, depth_of_label[label]
