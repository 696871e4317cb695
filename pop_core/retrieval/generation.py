"""The poses of the default library: what the prior learned, what the rules draw, and mixtures.

The prior knows how people move but saw nobody sit; the rules know furniture but not grace. Arms of
one on the trunk and legs of the other join both.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import (
    LOWER,
    TWIST_AXES,
    UPPER,
    pose_coordinates,
)
from pop_core.body.joints import JOINT_NAMES
from pop_core.body.model import BodyModel
from pop_core.geometry.swing_twist import from_swing_twist
from pop_core.retrieval.pose_library import pose_columns
from pop_core.retrieval.pose_prior import PosePrior
from pop_core.retrieval.procedural.clearance import limbs_clear
from pop_core.retrieval.procedural.families import FAMILIES, DrawnPoses, draw_batch

BATCH = 384
ARM_PARTS = ('collar', 'shoulder', 'elbow', 'wrist', 'hand')
ARMS = np.array([i for i, name in enumerate(JOINT_NAMES[1:]) if name.endswith(ARM_PARTS)])
PRIOR_SHARE = 0.22
MIXED_SHARE = 0.16
UPRIGHT_SIGMA_RAD = 0.12


def draw_poses(
    model: BodyModel, prior: PosePrior, rng: np.random.Generator, *, procedural: bool = True
) -> Iterator[DrawnPoses]:
    """Yield batches of human poses without end, decided by the generator.

    Args:
        model: Body whose proportions decide what touches what.
        prior: Learned prior.
        rng: Randomness.
        procedural: False draws from the prior alone.
    """
    families = list(FAMILIES.values())
    shares = np.array([family.share for family in families])
    while True:
        kind = rng.random()
        if not procedural or kind < PRIOR_SHARE:
            yield draw_from_prior(model, prior, rng, BATCH)
            continue
        family = families[rng.choice(len(families), p=shares / shares.sum())]
        poses = draw_batch(family, model, rng, BATCH)
        yield with_learned_arms(poses, model, prior, rng) if kind > 1 - MIXED_SHARE else poses


def draw_from_prior(
    model: BodyModel, prior: PosePrior, rng: np.random.Generator, n: int
) -> DrawnPoses:
    """Return what is possible of n poses drawn from the prior, near upright."""
    body_pose = within_limits(prior.sample(rng, n))
    tilt = rng.normal(0.0, UPRIGHT_SIGMA_RAD, (n, 3)) * [1.0, 0.3, 0.7]
    return only_clear(DrawnPoses(body_pose, tilt), model)


def with_learned_arms(
    poses: DrawnPoses, model: BodyModel, prior: PosePrior, rng: np.random.Generator
) -> DrawnPoses:
    """Return poses whose arms are exchanged for arms drawn from the prior."""
    body_pose = poses.body_pose.copy()
    body_pose[:, ARMS] = within_limits(prior.sample(rng, len(body_pose)))[:, ARMS]
    return only_clear(DrawnPoses(body_pose, poses.tilt), model)


def within_limits(body_pose: Float[np.ndarray, 'n 23 3']) -> Float[np.ndarray, 'n 23 3']:
    """Return poses with every coordinate clamped to its anatomical range."""
    return from_swing_twist(np.clip(pose_coordinates(body_pose), LOWER, UPPER), TWIST_AXES)


def only_clear(poses: DrawnPoses, model: BodyModel) -> DrawnPoses:
    """Return the poses that run no limb through the body."""
    joints = pose_columns(poses.body_pose, poses.tilt, model).transpose(2, 0, 1)
    keep = limbs_clear(joints)
    return DrawnPoses(poses.body_pose[keep], poses.tilt[keep])
