"""Limbs that keypoints contradict: they are let go and looked for anew.

A limb hidden at first may be followed where it is not, along the trunk say, and there looks well
observed. Only a keypoint tells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import N_JOINTS, PARENTS
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.limb_points import KINDS
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.tracking.body_filter import FilterState
from pop_core.tracking.limb_claims import ARM_LIMBS, LEG_LIMBS, LIMBS

STRANGE_M = 0.18  # a keypoint this far from the body, and surely lifted, contradicts it
SIGMAS = 4.0
LOOSE_RAD = 0.8
MOST_OPEN = 0.15  # of a limb: what the camera saw through was not there


def _loose_joints() -> Bool[np.ndarray, '4 24']:
    """Return which joints of the body turn with each limb: a hand or foot goes along."""
    out = np.zeros((len(LIMBS), N_JOINTS), dtype=bool)
    for number, (first, *between, _) in enumerate(LIMBS):
        out[number, [first, *between]] = True
        if number in ARM_LIMBS:
            out[number, PARENTS[first]] = True  # the collar
    return out


LOOSE_JOINTS = _loose_joints()


def contradicted_joints(body: BodyState, lifted: LiftedJoints) -> Bool[np.ndarray, 's']:
    """Return the shared joints that are surely lifted far from where the body has them."""
    offset = np.linalg.norm(body.landmarks - lifted.positions_camera, axis=1)
    with np.errstate(invalid='ignore'):
        far = offset > np.maximum(STRANGE_M, SIGMAS * lifted.sigma_m)
    return lifted.sure & far


def lost_limbs(contradicted: Bool[np.ndarray, 's']) -> list[Bool[np.ndarray, '24']]:
    """Return the joints of the legs, and of the arms, that contradicted joints belong to.

    Two of a kind are lost together: they may have been exchanged.
    """
    lost = [bool(contradicted[list(kind.keypoints)].any()) for kind in KINDS]
    pairs = [[limb for limb in pair if lost[limb]] for pair in (LEG_LIMBS, ARM_LIMBS)]
    return [np.asarray(LOOSE_JOINTS[pair].any(axis=0)) for pair in pairs if pair]


def limbs_in_the_open(open_share: Float[np.ndarray, '4']) -> list[Bool[np.ndarray, '24']]:
    """Return the joints of each limb that stands where the camera saw through too much of it."""
    return list(LOOSE_JOINTS[open_share > MOST_OPEN])


def loosened(predicted: FilterState, bones: Bool[np.ndarray, '24']) -> FilterState:
    """Return a belief in which some joints may have any rotation within reach."""
    turns = np.repeat(np.where(bones, LOOSE_RAD, 0.0), 3)
    extra: Float[np.ndarray, 'x'] = np.zeros(len(predicted.covariance))
    extra[3: 3 + len(turns)] = turns
    return replace(predicted, covariance=predicted.covariance + np.diag(extra**2))
