"""What depth says along the bone between two keypoints: limbs stand in no empty space.

Where a limb was seen, its skin runs along the bone; where something hides it, a nearer surface
does. Depth that was measured farther away than a limb denies it: the camera saw through its place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.keypoints import skeleton_tree_kernels as kernels
from pop_core.keypoints.skeleton import LIMB_ENDS, ORDER

SAMPLES = 6  # places along each bone
ASIDE_M = 0.02  # keypoints err: beside the bone is looked as well
# Cost of a bone all in empty space, behind another surface, or where nothing was measured.
EMPTY_COST, HIDDEN_COST, UNKNOWN_COST = 5.0, 1.5, 0.7
# Skin may lie this far from where the joints say, and costs the whole price this much further [m].
SLACK_M, SOFTNESS_M = 0.06, 0.1


def _bone_costs() -> Float[np.ndarray, 's 5']:
    """Return the costs of the bone to each joint; thick trunks tell little of theirs."""
    costs = np.tile([0.0, 0.0, 0.0, SLACK_M, SOFTNESS_M], (len(ORDER), 1))
    costs[LIMB_ENDS, :3] = EMPTY_COST, HIDDEN_COST, UNKNOWN_COST
    return costs


BONE_COSTS = _bone_costs()


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredBones:
    """The bones between the keypoints that show a surface, and the depth along them.

    Args:
        links: The joint that each hangs on, negative for none.
        depth_m: Depth measured along each limb's bones, as `depths_along_bones` returns it [m].
    """

    links: Int[np.ndarray, 's']
    depth_m: Float[np.ndarray, 's n 3']


def depths_along_bones(
    depth_m: Float32[np.ndarray, 'h w'],
    keypoints_px: Float[np.ndarray, 's 2'],
    links: Int[np.ndarray, 's'],
    focal_px_per_m: float,
) -> Float[np.ndarray, 's n 3']:
    """Return what was measured on and beside the line from each limb's joint to its link [m].

    Args:
        depth_m: Depth image [m], NaN where nothing was measured.
        keypoints_px: Pixels of the shared joints.
        links: The joint that each hangs on, negative for none.
        focal_px_per_m: Pixels of a metre at the person.
    """
    out = np.full((len(links), SAMPLES, 3), np.nan)
    for j in LIMB_ENDS[links[LIMB_ENDS] >= 0]:
        (u0, v0), (u1, v1) = keypoints_px[links[j]], keypoints_px[j]
        kernels.bone_samples(depth_m, u0, v0, u1, v1, ASIDE_M * focal_px_per_m, out[j])
    return out
