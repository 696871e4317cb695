"""The depth of every joint of one person, by exact inference on the skeleton tree.

Each keypoint shows one or more surfaces. The joint lies behind one of them, or an occluder hides
it, or the keypoint is wrong. Which of these is true for which joint is what bones decide: none is
much longer or shorter than a body's, and what was measured along it is its skin or hides it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.keypoints import lifting_kernels, skeleton_tree_kernels
from pop_core.keypoints.bone_evidence import BONE_COSTS, MeasuredBones
from pop_core.keypoints.depth_layers import DepthLayers
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.skeleton import LEGS, ORDER, PATH_M, TREE_PARENT

BIN_M = 0.03
MAX_BINS = 320
NEAREST_M = 0.05  # nothing is in the camera or behind it
# Costs are -log likelihoods.
# A joint behind an occluder, for keypoints of score 0 and 1: guesses are often hidden.
HIDDEN_COST_GUESSED, HIDDEN_COST_SURE = 0.4, 2.5
WRONG_COST = 6.0  # a keypoint that shows no surface its joint could lie behind
FOREIGN_COST = 4.0  # a surface outside the person's mask
BROKEN_BONE_COST = 8.0
OCCLUDER_COST = 2.5  # a surface that stands clear in front of the one it should continue
OCCLUDER_GAP_M = 0.25
BONE_TOLERANCE_M = 0.05
SHORTEST = 0.75  # bone relative to the mean one: keypoints and skin err at both ends
UNEXPECTED_COST, EXPECTED_TOLERANCE_M = 4.0, 0.05  # who believes something may be wrong
LEAN = 0.75  # spread of a bone's depth relative to its length, over varied poses


@dataclass(frozen=True, slots=True, eq=False)
class JointLayers:
    """Where each joint would lie behind each surface of its pixel.

    Args:
        layers: The surfaces.
        depth_m: Depth of the joint behind each surface [m].
        sigma_m: Standard deviation of that depth [m].
        price: Cost of each surface in itself.
        skin_m: Depth of each joint behind its skin [m].
    """

    layers: DepthLayers
    depth_m: Float[np.ndarray, 's l']
    sigma_m: Float[np.ndarray, 's l']
    price: Float[np.ndarray, 's l']
    skin_m: Float[np.ndarray, 's']


def layer_prices(
    depth_m: Float32[np.ndarray, 'h w'],
    keypoints_px: Float[np.ndarray, 's 2'],
    layers: DepthLayers,
    links: Int[np.ndarray, 's'],
    jump_ratio: float,
) -> Float[np.ndarray, 's l']:
    """Return the cost of lifting each keypoint onto each surface, whatever its depth.

    Surfaces of a small share of the patch cost, and so do those outside the person's mask, and
    those before a leg that jump out toward the camera on the way down from the hip: occluders.
    Arms cross the body far too often for that.
    """
    price = -np.log(np.maximum(layers.share, 1e-6)) + FOREIGN_COST * (1.0 - layers.own_share)
    gap_m = np.zeros(len(keypoints_px))
    for j in LEGS[links[LEGS] >= 0]:
        (u0, v0), (u1, v1) = keypoints_px[links[j]], keypoints_px[j]
        jump_m = lifting_kernels.approach(depth_m, u0, v0, u1, v1, jump_ratio)
        # What hides a knee hides the ankle below it, though no edge lies between them.
        gap_m[j] = gap_m[links[j]] + jump_m
        front = layers.depth_m[j] <= layers.depth_m[j][layers.share[j].argmax()]
        price[j] += front * OCCLUDER_COST * np.clip(gap_m[j] / OCCLUDER_GAP_M, 0.0, 1.0)
    return price


def choose_depths(
    joints: JointLayers,
    rays: Float[np.ndarray, 's 2'],
    scores: Float[np.ndarray, 's'],
    bones: MeasuredBones,
    size: float,
    stretch: float,
    *,
    expected: JointBelief | None = None,
) -> Float[np.ndarray, 's']:
    """Return the most probable depth of each joint [m], hidden ones included; NaN without surface.

    Args:
        joints: Joint depths behind each surface.
        rays: (x/z, y/z) of each keypoint.
        scores: Confidence of each keypoint.
        bones: What hangs on what, and the depth between.
        size: Size of the person relative to the mean default body.
        stretch: Longest bone relative to the mean one of that size.
        expected: What is believed of the joints already.
    """
    present = joints.layers.present
    bins = _bins(joints.depth_m[present])
    usable = joints.layers.known
    order = np.array([j for j in ORDER if usable[j]])
    chosen = np.zeros(len(scores), dtype=np.int64)
    cost = _unary(joints, bins, scores)
    if expected is not None:
        cost += _surprise(expected, bins)
    skeleton_tree_kernels.tree_depths(
        cost, bins, rays, bones.links, order,
        _limits(bones.links, size, stretch), BONE_TOLERANCE_M, BROKEN_BONE_COST, bones.depth_m,
        joints.skin_m, BONE_COSTS, chosen)
    return np.where(usable, bins[chosen], np.nan)


def _limits(
    links: Int[np.ndarray, 's'], size: float, stretch: float
) -> Float[np.ndarray, 's 3']:
    """Return shortest and longest distance of each joint to its link, spread of its depth [m]."""
    path = size * np.where(links >= 0, PATH_M[np.arange(len(links)), links], 1.0)
    # Across a joint that was not found, the way may bend as it likes.
    shortest = np.where(links == TREE_PARENT, SHORTEST * path, 0.0)
    return np.column_stack([shortest, stretch * path, LEAN * path])


def nearest_layer(
    joints: JointLayers, depth_m: Float[np.ndarray, 's']
) -> Int[np.ndarray, 's']:
    """Return the surface behind which each joint lies best at the given depths [m]."""
    with np.errstate(invalid='ignore'):
        misfit = ((depth_m[:, None] - joints.depth_m) / joints.sigma_m) ** 2
    misfit = 0.5 * misfit + joints.price
    return np.where(joints.layers.present, misfit, np.inf).argmin(axis=1)


def _bins(depth_m: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'm']:
    low, high = max(float(depth_m.min()) - 0.3, NEAREST_M), float(depth_m.max()) + 0.6
    count = int(np.clip(np.ceil((high - low) / BIN_M), 2, MAX_BINS))
    return np.linspace(low, high, count)


def _unary(
    joints: JointLayers, bins: Float[np.ndarray, 'm'], scores: Float[np.ndarray, 's']
) -> Float[np.ndarray, 's m']:
    """Return the cost of each joint at each depth; uncertain keypoints cost less."""
    present = joints.layers.present
    sigma_m = np.hypot(joints.sigma_m, 0.5 * (bins[1] - bins[0]))
    gap = (bins - joints.depth_m[..., None]) / sigma_m[..., None]
    behind = 0.5 * gap**2 + joints.price[..., None]
    hidden = np.where(gap > 0, hidden_price(joints.layers, scores)[..., None], np.inf)
    each = np.where(present[..., None], np.minimum(behind, hidden), np.inf)
    return np.minimum(each.min(axis=1), WRONG_COST) * (0.3 + 0.7 * scores[:, None])


def _surprise(expected: JointBelief, bins: Float[np.ndarray, 'm']) -> Float[np.ndarray, 's m']:
    """Return the cost of each joint at each depth for being elsewhere than is believed."""
    sigma_m = np.hypot(expected.sigma_m, EXPECTED_TOLERANCE_M)[:, None]
    off = (bins - expected.positions_camera[:, 2:]) / sigma_m
    return np.minimum(0.5 * off**2, UNEXPECTED_COST)


def hidden_price(
    layers: DepthLayers, scores: Float[np.ndarray, 's']
) -> Float[np.ndarray, 's l']:
    """Return the cost of each surface hiding its joint; one that fills the patch hides it best."""
    cost = HIDDEN_COST_GUESSED + (HIDDEN_COST_SURE - HIDDEN_COST_GUESSED) * scores
    return np.asarray(cost[:, None] - np.log(np.maximum(layers.share, 1e-6)))
