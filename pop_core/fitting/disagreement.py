"""What a fit leaves open: where other hypotheses ended, and which limbs no keypoint names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import JOINT_INDEX, JOINT_NAMES, N_JOINTS, SHARED_INDEX
from pop_core.fitting.body_state import BodyState
from pop_core.keypoints.lifted_joints import LiftedJoints

AGREES_M = 0.12  # a keypoint farther from the body than this does not confirm its joint
# The keypoint that a limb's joint is confirmed by; hands and feet have none of their own.
ARM = {'elbow': 'elbow', 'wrist': 'wrist', 'hand': 'wrist'}
LEG = {'knee': 'knee', 'ankle': 'ankle', 'foot': 'ankle'}
NAMED_BY = ARM | LEG


def _limb_joints() -> tuple[list[int], list[int]]:
    joints, rows = [], []
    for name in JOINT_NAMES:
        side, _, kind = name.partition('_')
        if kind in NAMED_BY:
            joints.append(JOINT_INDEX[name])
            rows.append(SHARED_INDEX[f'{side}_{NAMED_BY[kind]}'])
    return joints, rows


LIMB_JOINTS, KEYPOINT_OF_LIMB_JOINT = _limb_joints()


@dataclass(frozen=True, slots=True, eq=False)
class Disagreement:
    """What a fit leaves open beside the curvature of its cost.

    Args:
        rivals: Joints of the runners-up, from the winner's [m].
        excess: What each of them costs beyond the winner.
        retrieved: Second moment of the joints over all started hypotheses, about the winner's
            [m^2].
        unnamed: Joints of limbs that no keypoint confirms.
    """

    rivals: Float[np.ndarray, 'k 24 3']
    excess: Float[np.ndarray, 'k']
    retrieved: Float[np.ndarray, '24 3 3']
    unnamed: Bool[np.ndarray, '24']


def disagreement(
    winner: BodyState, rivals: Sequence[BodyState], excess: Sequence[float],
    started: Sequence[BodyState], unnamed: Bool[np.ndarray, '24'],
) -> Disagreement:
    """Return what other hypotheses say against a winner.

    Args:
        winner: The body.
        rivals: Runners-up.
        excess: What each of them costs beyond the winner.
        started: Every retrieved hypothesis, where its own pose ended.
        unnamed: Joints of limbs that no keypoint confirms.
    """
    return Disagreement(
        _offsets(winner, rivals), np.array(excess, dtype=np.float64),
        _second_moment(_offsets(winner, started)), unnamed)


def unnamed_joints(body: BodyState, lifted: LiftedJoints) -> Bool[np.ndarray, '24']:
    """Return the joints of limbs whose keypoint was not lifted, or is not where the body is."""
    off_m = np.linalg.norm(body.landmarks - lifted.positions_camera, axis=1)
    with np.errstate(invalid='ignore'):
        confirmed = off_m < AGREES_M
    out = np.zeros(N_JOINTS, dtype=bool)
    out[LIMB_JOINTS] = ~confirmed[KEYPOINT_OF_LIMB_JOINT]
    return out


def _offsets(
    winner: BodyState, others: Sequence[BodyState]
) -> Float[np.ndarray, 'k 24 3']:
    return np.array([other.joints - winner.joints for other in others]).reshape(-1, N_JOINTS, 3)


def _second_moment(offsets: Float[np.ndarray, 'k 24 3']) -> Float[np.ndarray, '24 3 3']:
    return np.asarray(
        np.einsum('kja,kjb->jab', offsets, offsets) / max(len(offsets), 1))
