"""Arms and legs as chains of bones: where many rotations of one would put it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX, PARENTS, SHARED_INDEX
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.limb_kernels import chain_points

HAND = 1.6  # hands and feet end this far beyond their joints' rest distance


@dataclass(frozen=True, slots=True)
class LimbKind:
    """An arm or leg: its joints from the first that turns to the end, and its thickness.

    Args:
        joints: Joint indices; all but the last turn.
        keypoints: Shared joints at the second and third of them.
        shares: Where points are taken along each bone.
        radii_m: Of each bone.
    """

    joints: tuple[int, int, int, int]
    keypoints: tuple[int, int]
    shares: tuple[tuple[float, ...], ...]
    radii_m: tuple[float, float, float]

    @property
    def rows(self) -> list[int]:
        """Return the rows of the body pose that turn the limb."""
        return [joint - 1 for joint in self.joints[:3]]


def _kind(
    side: str, names: tuple[str, str, str, str], shares: tuple[tuple[float, ...], ...],
    radii_m: tuple[float, float, float],
) -> LimbKind:
    first, second, third, last = (JOINT_INDEX[f'{side}_{name}'] for name in names)
    keypoints = (SHARED_INDEX[f'{side}_{names[1]}'], SHARED_INDEX[f'{side}_{names[2]}'])
    return LimbKind((first, second, third, last), keypoints, shares, radii_m)


ARM, LEG = ('shoulder', 'elbow', 'wrist', 'hand'), ('hip', 'knee', 'ankle', 'foot')
# The first third of an upper bone is trunk.
KINDS = (
    *(_kind(side, ARM, ((0.4, 0.7, 1.0), (0.33, 0.67, 1.0), (0.5, 1.0)), (0.045, 0.04, 0.03))
      for side in ('left', 'right')),
    *(_kind(side, LEG, ((0.35, 0.6, 0.85), (0.1, 0.4, 0.7, 1.0), (0.5, 1.0)), (0.075, 0.05, 0.03))
      for side in ('left', 'right')))


@dataclass(frozen=True, slots=True, eq=False)
class LimbPoints:
    """Many ways of one limb to be, as points along its bones.

    Args:
        points: On the bones, camera frame [m].
        ends: Second and third joint, camera frame [m].
        width_m: Thickness of the limb at each point.
        length_m: Length of the limb that each point stands for.
    """

    points: Float[np.ndarray, 'n p 3']
    ends: Float[np.ndarray, 'n 2 3']
    width_m: Float[np.ndarray, 'p']
    length_m: Float[np.ndarray, 'p']


def limb_points(
    state: BodyState, kind: LimbKind, turns: Float[np.ndarray, 'n 3 3 3']
) -> LimbPoints:
    """Return where a body would have a limb, for many rotations of its three joints."""
    skeleton, scale = state.skeleton, state.parameters.scale
    here, there = list(kind.joints[:-1]), list(kind.joints[1:])
    bones = scale * (skeleton.rest_joints[there] - skeleton.rest_joints[here])
    bones[2] *= HAND
    per_bone = [len(shares) for shares in kind.shares]
    bone = np.repeat(np.arange(len(bones)), per_bone)
    points, ends = chain_points(
        turns, skeleton.G[PARENTS[kind.joints[0]]], state.joints[kind.joints[0]], bones, bone,
        np.concatenate(kind.shares))
    length_m = np.linalg.norm(bones, axis=1) / per_bone
    return LimbPoints(
        points, ends, 2.0 * scale * np.array(kind.radii_m)[bone], length_m[bone])
