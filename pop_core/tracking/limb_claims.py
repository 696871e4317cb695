"""Which measured points a limb may claim: none that surer parts of the body explain as well.

An arm that swings behind the trunk lies near the trunk's surface, and would be found there, ever
surer of its place. A point says as much of a limb as it would be amiss were the limb not there:
it is compared with the depth image of everything surer. The trunk is surest; limbs follow by the
doubt of their prediction. An arm left with few points is hidden, and claims none.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import JOINT_NAMES, SHARED_INDEX
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.depth_consistency import Visibility
from pop_core.fitting.limb_points import KINDS
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs
from pop_core.rendering.depth_renderer import render_parts
from pop_core.tracking.claim_kernels import claimed_shares

LIMBS = tuple(kind.joints for kind in KINDS)
TRUNK = len(LIMBS)  # the part of all that is no limb
ARM_LIMBS, LEG_LIMBS = (0, 1), (2, 3)  # in the order of KINDS
ENDS = np.array([SHARED_INDEX[JOINT_NAMES[limb[2]]] for limb in LIMBS])  # wrists and ankles
TRUNK_SIGMA_M = 0.02  # cloth, and the place of what is surer
RIM_PX = 2  # cloth and hair make a body wider than its model
OPEN_M = 0.08  # in front of what is measured
HIDDEN_SHARE, FEWEST_POINTS = 0.5, 20.0


def _limb_of_bone() -> Int[np.ndarray, '24']:
    out = np.full(len(JOINT_NAMES), -1)
    for number, limb in enumerate(LIMBS):
        out[list(limb)] = number
    return out


LIMB_OF_BONE = _limb_of_bone()


def limbs_of(bones: Bool[np.ndarray, '24']) -> Int[np.ndarray, 'n']:
    """Return the limbs that some joints belong to."""
    limbs = np.unique(LIMB_OF_BONE[bones])
    return limbs[limbs >= 0]


@lru_cache(maxsize=4)
def parts_of(body: FitBody) -> tuple[Int[np.ndarray, 'n'], Int[np.ndarray, 'm']]:
    """Return the limb of each vertex of a body, -1 for none, and of each face, or TRUNK."""
    limb_of_vertex = LIMB_OF_BONE[body.main_bone]
    limb_of_face = limb_of_vertex[body.faces].max(axis=1)
    return limb_of_vertex, np.where(limb_of_face < 0, TRUNK, limb_of_face)


def open_shares(
    state: BodyState, visibility: Visibility, observation: Observation
) -> Float[np.ndarray, '4']:
    """Return the share of each limb, of what is toward the camera, that the camera saw through."""
    facing = visibility.facing
    # Beside the rim of a limb the camera sees what is behind it.
    nearest_m = cv2.erode(np.nan_to_num(observation.depth_m), np.ones((3, 3), np.uint8))
    around = replace(observation, depth_m=nearest_m)
    gap_m = around.depth_at(state.vertices[facing])[0] - state.vertices[facing, 2]
    through = np.isfinite(gap_m) & (gap_m > OPEN_M)
    limb = parts_of(state.body)[0][facing]
    count = np.array([(limb == number).sum() for number in range(len(LIMBS))])
    opened = np.array([through[limb == number].sum() for number in range(len(LIMBS))])
    return np.asarray(opened / np.maximum(count, 1))


class LimbClaims:
    """What is surer than each limb of a body, as the camera would see it alone."""

    def __init__(
        self, state: BodyState, observation: Observation, doubt_m: Float[np.ndarray, 's']
    ) -> None:
        """Render a body part by part.

        Args:
            state: Body.
            observation: What the sensor says.
            doubt_m: Standard deviation of each shared joint's predicted place.
        """
        self.observation = observation
        self.limb_of_vertex, part_of_face = parts_of(state.body)
        order = [TRUNK, *np.argsort(doubt_m[ENDS], kind='stable').tolist()]
        rank = np.argsort(order)
        self._is_surer = rank[None, :] < rank[:TRUNK, None]
        self._alone_m = render_parts(
            state.vertices, state.body.faces, part_of_face, TRUNK + 1, observation.camera,
            closed=state.body.is_closed)

    def weighed(self, pairs: Pairs) -> tuple[Pairs, Float[np.ndarray, '4']]:
        """Return pairs by what they say of limbs, and the weight that is left to each limb.

        Args:
            pairs: Vertices and measured points.
        """
        limb_of_pair = self.limb_of_vertex[pairs.vertex]
        weight = pairs.weight.copy()
        of_limb = np.zeros(len(LIMBS))
        every = np.flatnonzero(limb_of_pair >= 0)
        shares = self._share(pairs.target[every], limb_of_pair[every])
        for limb in range(len(LIMBS)):
            own = limb_of_pair[every] == limb
            rows, share = every[own], shares[own]
            left = weight[rows] * share
            few = share.sum() < FEWEST_POINTS or left.sum() < HIDDEN_SHARE * weight[rows].sum()
            weight[rows] = 0.0 if few and limb in ARM_LIMBS else left
            of_limb[limb] = weight[rows].sum()
        return replace(pairs, weight=weight), of_limb

    def _share(
        self, points: Float[np.ndarray, 'n 3'], limb: Int[np.ndarray, 'n']
    ) -> Float[np.ndarray, 'n']:
        """Return how little each point is explained by what is surer than its limb, 0..1."""
        camera, noise = self.observation.camera, self.observation.noise
        sigma_m = np.hypot(TRUNK_SIGMA_M, noise.sigma_m(points[:, 2]))
        return np.asarray(claimed_shares(
            points, limb, sigma_m, self._alone_m, self._is_surer, RIM_PX,
            camera.fx, camera.fy, camera.cx, camera.cy))
