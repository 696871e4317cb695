"""Families of poses: which gestures go with which posture, and how often each is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import mirrored_pose
from pop_core.body.model import BodyModel
from pop_core.retrieval.pose_library import pose_columns
from pop_core.retrieval.procedural import gestures as g
from pop_core.retrieval.procedural import postures as p
from pop_core.retrieval.procedural.clearance import limbs_clear
from pop_core.retrieval.procedural.figures import SIDES, Figures

BOTH_ALIKE = 0.4  # share of batches whose two arms do the same
UPRIGHT_GESTURES = (
    g.hanging, g.reaching, g.reaching, g.reaching, g.pointing, g.overhead, g.in_front, g.crossed,
    g.on_hip, g.at_head, g.behind_back, g.on_armrest,
)
SEATED_GESTURES = (
    g.on_thigh, g.on_thigh, g.reaching, g.reaching, g.reaching, g.in_front, g.pointing, g.crossed,
    g.at_head, g.on_armrest, g.on_armrest, g.hanging, g.overhead, g.propped, g.to_shin,
)
WORKING_GESTURES = (
    g.hanging, g.reaching, g.reaching, g.reaching, g.in_front, g.on_thigh, g.pointing, g.to_shin,
    g.overhead, g.propped, g.at_head,
)
LYING_GESTURES = (
    g.hanging, g.reaching, g.reaching, g.reaching, g.at_head, g.overhead, g.crossed, g.on_thigh,
    g.in_front,
)


@dataclass(frozen=True, slots=True)
class Family:
    """One kind of pose.

    Args:
        posture: Draws trunk and legs.
        gestures: What its arms may do; listed twice is drawn twice as often.
        share: Share of the library.
    """

    posture: p.Posture
    gestures: tuple[g.Gesture, ...]
    share: float


FAMILIES = {
    'standing': Family(p.standing, UPRIGHT_GESTURES, 0.16),
    'walking': Family(p.walking, UPRIGHT_GESTURES, 0.13),
    'sitting': Family(p.sitting, SEATED_GESTURES, 0.22),
    'sitting crossed': Family(p.sitting_crossed, SEATED_GESTURES, 0.06),
    'sitting on the floor': Family(p.floor_sitting, SEATED_GESTURES, 0.07),
    'crouching': Family(p.crouching, WORKING_GESTURES, 0.08),
    'kneeling': Family(p.kneeling, WORKING_GESTURES, 0.05),
    'half kneeling': Family(p.half_kneeling, WORKING_GESTURES, 0.05),
    'bending': Family(p.bending, WORKING_GESTURES, 0.08),
    'climbing': Family(p.climbing, UPRIGHT_GESTURES, 0.05),
    'lying': Family(p.lying, LYING_GESTURES, 0.05),
}


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPoses:
    """Poses and how their pelvis is turned.

    Args:
        body_pose: Rotation vectors of joints 1..23 [rad].
        tilt: Rotation vector of the pelvis in the upright frame [rad].
    """

    body_pose: Float[np.ndarray, 'n 23 3']
    tilt: Float[np.ndarray, 'n 3']


def draw_batch(
    family: Family, model: BodyModel, rng: np.random.Generator, n: int
) -> DrawnPoses:
    """Return what is possible of n drawn poses of one family: one gesture per arm, mirrored half.

    Poses whose limbs would exceed their limits or run through the body are left out.
    """
    figures = Figures(n, model)
    family.posture(figures, rng)
    left, right = rng.integers(0, len(family.gestures), 2)
    if rng.random() < BOTH_ALIKE:
        right = left
    for side, index in (('left', left), ('right', right)):
        family.gestures[index](figures, side, rng)
        loosen_hand(figures, side, rng)
    look_around(figures, rng)
    poses = DrawnPoses(figures.limited(), figures.tilt)
    joints = pose_columns(poses.body_pose, poses.tilt, model).transpose(2, 0, 1)
    keep = figures.reached & limbs_clear(joints)
    return _half_mirrored(DrawnPoses(poses.body_pose[keep], poses.tilt[keep]), rng)


def loosen_hand(figures: Figures, side: str, rng: np.random.Generator) -> None:
    """Draw the turn of the forearm, the bend of the wrist and of the fingers."""
    n, sign = figures.n, SIDES[side]
    turn = np.stack([rng.normal(0.2, 0.5, n), rng.normal(0, 0.12, n), rng.normal(0, 0.3, n)], 1)
    figures.turn_joint(f'{side}_wrist', turn * [0.6, 1.0, 1.0])
    curl = np.stack([np.zeros(n), np.zeros(n), -sign * rng.uniform(0.0, 0.7, n)], axis=1)
    figures.turn_joint(f'{side}_hand', curl)


def look_around(figures: Figures, rng: np.random.Generator) -> None:
    """Draw the turn of the head; it rights itself against half of the trunk's lean."""
    n = figures.n
    chest = figures.chest()[0]
    lean = np.arctan2(chest[:, 2, 1], chest[:, 1, 1])
    righting = -0.5 * np.clip(lean, -0.8, 1.2)
    figures.turn_head(np.stack(
        [righting + rng.normal(0.05, 0.22, n), rng.normal(0, 0.4, n), rng.normal(0, 0.12, n)], 1))


def _half_mirrored(poses: DrawnPoses, rng: np.random.Generator) -> DrawnPoses:
    flip = rng.random(len(poses.tilt)) < 0.5
    body_pose = np.where(flip[:, None, None], mirrored_pose(poses.body_pose), poses.body_pose)
    tilt = np.where(flip[:, None], poses.tilt * [1.0, -1.0, -1.0], poses.tilt)
    return DrawnPoses(body_pose, tilt)
