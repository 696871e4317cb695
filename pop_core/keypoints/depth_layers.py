"""The surfaces that lie under each keypoint: depth layers of a small patch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32

from pop_core.keypoints import lifting_kernels as kernels

GUESS_RADIUS_PX = 4.0
MAX_RADIUS_PX = 24.0


@dataclass(frozen=True, slots=True, eq=False)
class DepthLayers:
    """Surfaces near each keypoint, in no order; rows without a surface have share 0.

    Args:
        depth_m: Median depth of each surface [m].
        share: Share of the patch that shows it, pixels near the keypoint counting most.
        spread_m: Robust standard deviation of its depth [m].
        own_share: Share of it that lies in the person's mask; 1 without a mask.
    """

    depth_m: Float[np.ndarray, 's l']
    share: Float[np.ndarray, 's l']
    spread_m: Float[np.ndarray, 's l']
    own_share: Float[np.ndarray, 's l']

    @property
    def present(self) -> Bool[np.ndarray, 's l']:
        """Return which entries hold a surface."""
        return np.asarray(self.share > 0)

    @property
    def known(self) -> Bool[np.ndarray, 's']:
        """Return which keypoints have a surface under them."""
        return np.asarray(self.present.any(axis=1))

    @property
    def middle_m(self) -> float:
        """Return the median depth of all surfaces [m]; inf without any."""
        return float(np.median(self.depth_m[self.present])) if self.present.any() else np.inf


def find_layers(
    depth_m: Float32[np.ndarray, 'h w'],
    person_mask: Bool[np.ndarray, 'h w'],
    keypoints_px: Float[np.ndarray, 's 2'],
    patch_px_m: float,
    gap_ratio: float,
) -> DepthLayers:
    """Return the surfaces under keypoints; a NaN keypoint has none.

    Args:
        depth_m: Depth image [m], NaN where nothing was measured.
        person_mask: Pixels of the person, all of them when unknown.
        keypoints_px: Pixels of the keypoints.
        patch_px_m: Radius of the patch times depth [px m].
        gap_ratio: Jump of depth that separates two surfaces, as a share of depth.
    """
    out = np.zeros((len(keypoints_px), kernels.MAX_LAYERS, 4))
    for layers, (u, v) in zip(out, keypoints_px, strict=True):
        if not np.isfinite(u + v):
            continue
        found = kernels.patch_layers(
            depth_m, person_mask, u, v, GUESS_RADIUS_PX, gap_ratio, layers)
        # Far people are small: the patch covers the same part of a limb at every distance.
        nearest = layers[:found, 0].min() if found else np.inf
        radius = float(np.clip(patch_px_m / nearest, 2.0, MAX_RADIUS_PX)) if found else 12.0
        kernels.patch_layers(depth_m, person_mask, u, v, radius, gap_ratio, layers)
    return DepthLayers(out[..., 0], out[..., 1], out[..., 2], out[..., 3])
