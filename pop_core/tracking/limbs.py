"""Limbs that keypoints contradict: they are let go and looked for anew.

A limb hidden at first may be followed where it is not, along the trunk say, and there looks well
observed. Only a keypoint tells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import JOINT_INDEX, N_JOINTS, SHARED_NAMES
from pop_core.fitting.body_state import BodyState
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.tracking.body_filter import FilterState
from pop_core.tracking.limb_claims import ARM_LIMBS

STRANGE_M = 0.18  # a keypoint this far from the body, and surely lifted, contradicts it
SURE_SCORE = 0.55
SIGMAS = 4.0
LOOSE_RAD = 0.8
MOST_OPEN = 0.15  # of a limb: what the camera saw through was not there
ARM, LEG = ('collar', 'shoulder', 'elbow', 'wrist'), ('hip', 'knee', 'ankle')
LIMB_OF = {'elbow': ARM, 'wrist': ARM, 'knee': LEG, 'ankle': LEG}


def contradicted_joints(body: BodyState, lifted: LiftedJoints) -> Bool[np.ndarray, 's']:
    """Return the shared joints that are surely lifted far from where the body has them."""
    offset = np.linalg.norm(body.landmarks - lifted.positions_camera, axis=1)
    with np.errstate(invalid='ignore'):
        far = offset > np.maximum(STRANGE_M, SIGMAS * lifted.sigma_m)
    return lifted.lifted & far & (lifted.scores >= SURE_SCORE)


def lost_limbs(contradicted: Bool[np.ndarray, 's']) -> list[Bool[np.ndarray, '24']]:
    """Return the joints of the arms, and of the legs, that contradicted joints belong to.

    Two of a kind are lost together: they may have been exchanged.
    """
    found: dict[tuple[str, ...], Bool[np.ndarray, '24']] = {}
    for row in np.flatnonzero(contradicted):
        side, _, kind = SHARED_NAMES[row].partition('_')
        parts = LIMB_OF.get(kind)
        if parts is not None:
            bones = found.setdefault(parts, np.zeros(N_JOINTS, dtype=bool))
            bones[[JOINT_INDEX[f'{side}_{part}'] for part in parts]] = True
    return list(found.values())


def limbs_in_the_open(open_share: Float[np.ndarray, '4']) -> list[Bool[np.ndarray, '24']]:
    """Return the joints of each limb that stands where the camera saw through too much of it."""
    return [_joints_of(number) for number in np.flatnonzero(open_share > MOST_OPEN).tolist()]


def _joints_of(limb: int) -> Bool[np.ndarray, '24']:
    side = 'left' if limb % 2 == 0 else 'right'
    parts = ARM if limb in ARM_LIMBS else LEG
    bones = np.zeros(N_JOINTS, dtype=bool)
    bones[[JOINT_INDEX[f'{side}_{part}'] for part in parts]] = True
    return bones


def loosened(predicted: FilterState, bones: Bool[np.ndarray, '24']) -> FilterState:
    """Return a belief in which some joints may have any rotation within reach."""
    turns = np.repeat(np.where(bones, LOOSE_RAD, 0.0), 3)
    extra: Float[np.ndarray, 'x'] = np.zeros(len(predicted.covariance))
    extra[3: 3 + len(turns)] = turns
    return replace(predicted, covariance=predicted.covariance + np.diag(extra**2))
