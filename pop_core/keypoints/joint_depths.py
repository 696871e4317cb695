"""The depth of every joint of one person, by exact inference on the skeleton tree.

Each keypoint shows one or more surfaces. The joint lies behind one of them, or an occluder hides
it, or the keypoint is wrong. Which of these is true for which joint is what bones decide: no bone
is longer than a body's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pop_core.keypoints import lifting_kernels as kernels
from pop_core.keypoints.depth_layers import DepthLayers
from pop_core.keypoints.skeleton import BONE_M, ORDER, TREE_PARENT

BIN_M = 0.03
MAX_BINS = 320
HIDDEN_COST = 3.0  # of a joint that lies behind an occluder, in units of -log likelihood
WRONG_COST = 6.0  # of a keypoint that shows no surface its joint could lie behind
FOREIGN_COST = 4.0  # of a surface outside the person's mask
BROKEN_BONE_COST = 8.0
BONE_TOLERANCE_M = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class JointLayers:
    """Where each joint would lie behind each surface of its pixel.

    Args:
        layers: The surfaces.
        depth_m: Depth of the joint behind each surface [m].
        sigma_m: Standard deviation of that depth [m].
    """

    layers: DepthLayers
    depth_m: Float[np.ndarray, 's l']
    sigma_m: Float[np.ndarray, 's l']


def choose_depths(
    joints: JointLayers,
    rays: Float[np.ndarray, 's 2'],
    scores: Float[np.ndarray, 's'],
    scale: float,
    stretch: float,
) -> Float[np.ndarray, 's']:
    """Return the most probable depth of each joint [m], hidden ones included.

    Args:
        joints: Joint depths behind each surface.
        rays: (x/z, y/z) of each keypoint; NaN where undetected.
        scores: Confidence of each keypoint.
        scale: Size of the person relative to the default body.
        stretch: Longest bone relative to the mean bone of that size.
    """
    present = joints.layers.present
    bins = _bins(joints.depth_m[present])
    unary = _unary(joints, bins, scores)
    chosen = np.zeros(len(scores), dtype=np.int64)
    kernels.tree_depths(
        unary, bins, rays, TREE_PARENT, ORDER, BONE_M * scale * stretch, BONE_TOLERANCE_M,
        BROKEN_BONE_COST, chosen)
    return bins[chosen]


def nearest_layer(
    joints: JointLayers, depth_m: Float[np.ndarray, 's']
) -> Int[np.ndarray, 's']:
    """Return the surface behind which each joint lies best at the given depths [m]."""
    with np.errstate(divide='ignore', invalid='ignore'):
        misfit = ((depth_m[:, None] - joints.depth_m) / joints.sigma_m) ** 2
    misfit = misfit - 2.0 * np.log(np.maximum(joints.layers.share, 1e-6))
    return np.where(joints.layers.present, misfit, np.inf).argmin(axis=1)


def _bins(depth_m: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'm']:
    low, high = float(depth_m.min()) - 0.3, float(depth_m.max()) + 0.6
    count = int(np.clip(np.ceil((high - low) / BIN_M), 2, MAX_BINS))
    return np.linspace(low, high, count)


def _unary(
    joints: JointLayers, bins: Float[np.ndarray, 'm'], scores: Float[np.ndarray, 's']
) -> Float[np.ndarray, 's m']:
    """Return the cost of each joint at each depth; 0 everywhere where nothing was measured."""
    layers = joints.layers
    present = layers.present
    sigma = np.hypot(joints.sigma_m, 0.5 * (bins[1] - bins[0]))
    with np.errstate(divide='ignore', invalid='ignore'):
        gap = (bins[None, None] - joints.depth_m[..., None]) / sigma[..., None]
    foreign = FOREIGN_COST * (1.0 - layers.own_share)
    price = foreign - np.log(np.maximum(layers.share, 1e-6))
    behind = np.where(present[..., None], 0.5 * gap**2 + price[..., None], np.inf).min(axis=1)
    # Something nearer than the joint hides it; a surface that covers the patch hides it best.
    hides = present[..., None] & (gap > 0)
    hidden = np.where(hides, -np.log(np.maximum(layers.share, 1e-6))[..., None], np.inf)
    cost = np.minimum(behind, hidden.min(axis=1) + HIDDEN_COST)
    cost = np.minimum(cost, WRONG_COST)
    return np.where(present.any(axis=1)[:, None], cost * (0.3 + 0.7 * scores[:, None]), 0.0)
