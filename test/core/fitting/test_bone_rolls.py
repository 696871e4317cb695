"""Rolled limbs are told from their limits, and unrolled without moving a joint."""

import numpy as np
import pytest

from pop_core.body.joint_limits import LOWER, TWIST_AXES, UPPER
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, rest_parameters
from pop_core.fitting.bone_rolls import (
    EASE,
    LIMBS,
    ROLLS_RAD,
    HingedLimb,
    easiest_reading,
    rolled_limbs,
    unrolled,
)
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.geometry.swing_twist import to_swing_twist
from pop_core.synthesis.poses import POSE_KINDS, draw_pose

LEFT_LEG, RIGHT_LEG, LEFT_ARM, RIGHT_ARM = LIMBS
# Hands, toes and fingers turn with the bone before them.
CARRIED = [JOINT_INDEX[name] for name in ('left_foot', 'right_foot', 'left_hand', 'right_hand')]
KEPT = [joint for joint in range(24) if joint not in CARRIED]


def bent_pose() -> np.ndarray:
    """Knees bent by 70 degrees, elbows by 80, hips and shoulders away from rest."""
    pose = np.zeros((23, 3))
    pose[[LEFT_LEG.upper - 1, RIGHT_LEG.upper - 1], 0] = -1.0
    pose[[LEFT_LEG.hinge - 1, RIGHT_LEG.hinge - 1], 0] = 1.2
    pose[LEFT_ARM.upper - 1, 2], pose[RIGHT_ARM.upper - 1, 2] = -0.9, 0.9
    pose[LEFT_ARM.hinge - 1, 1], pose[RIGHT_ARM.hinge - 1, 1] = -1.4, 1.4
    return pose


def rolled(body: BodyModel, pose: np.ndarray, limb: HingedLimb, angle_rad: float) -> np.ndarray:
    """Turn the upper bone about its axis and the hinge back: every joint stays."""
    bone, _ = limb.bones(body.joint_template)
    turn = from_rotvec(angle_rad * bone / np.linalg.norm(bone))
    R = from_rotvec(pose)
    out = pose.copy()
    out[limb.upper - 1] = to_rotvec(R[limb.upper - 1] @ turn)
    out[limb.hinge - 1] = to_rotvec(turn.T @ R[limb.hinge - 1])
    return out


def joints_of(body: BodyModel, pose: np.ndarray) -> np.ndarray:
    return joints(body, rest_parameters().replaced(body_pose=pose))


@pytest.mark.parametrize('limb', LIMBS)
@pytest.mark.parametrize('degrees', [90, -90, 120, 180])
def test_a_rolled_limb_is_found_and_turned_back(
    body: BodyModel, limb: HingedLimb, degrees: int
) -> None:
    pose = rolled(body, bent_pose(), limb, np.deg2rad(degrees))
    assert rolled_limbs(pose) == [limb]
    found = unrolled(pose, body.joint_template)
    assert rolled_limbs(found) == []
    np.testing.assert_allclose(
        joints_of(body, found)[KEPT], joints_of(body, pose)[KEPT], atol=1e-9)
    rows = [limb.upper - 1, limb.hinge - 1]
    turn = from_rotvec(found[rows]) @ from_rotvec(bent_pose()[rows]).transpose(0, 2, 1)
    # Pronation cannot be told from joints, and the grid is 7.5 degrees wide.
    assert np.linalg.norm(to_rotvec(turn), axis=1)[0] < np.deg2rad(25)


def test_people_have_no_rolled_limbs(body: BodyModel) -> None:
    rng = np.random.default_rng(0)
    for kind in POSE_KINDS:
        for _ in range(10):
            pose = draw_pose(body, kind, rng).body_pose
            assert rolled_limbs(pose) == []
            np.testing.assert_array_equal(unrolled(pose, body.joint_template), pose)


def test_a_knee_bent_forward_is_a_rolled_leg() -> None:
    pose = bent_pose()
    pose[LEFT_LEG.hinge - 1, 0] = -0.8
    assert rolled_limbs(pose) == [LEFT_LEG]


def test_several_rolled_limbs_are_turned_back_at_once(body: BodyModel) -> None:
    pose = rolled(body, rolled(body, bent_pose(), LEFT_ARM, 2.5), RIGHT_LEG, 3.0)
    assert rolled_limbs(pose) == [RIGHT_LEG, LEFT_ARM]
    assert rolled_limbs(unrolled(pose, body.joint_template)) == []


def test_limbs_are_left_as_they_are_beside_a_rolled_one(body: BodyModel) -> None:
    pose = rolled(body, bent_pose(), LEFT_LEG, np.pi)
    found = unrolled(pose, body.joint_template)
    others = [row for row in range(23) if row + 1 not in (LEFT_LEG.upper, LEFT_LEG.hinge)]
    np.testing.assert_array_equal(found[others], pose[others])


@pytest.mark.parametrize('limb', LIMBS)
def test_the_easiest_reading_is_the_cheapest_of_the_grid(
    body: BodyModel, limb: HingedLimb
) -> None:
    rng = np.random.default_rng(limb.upper)
    rows = [limb.upper - 1, limb.hinge - 1]
    upper_bone, lower_bone = (
        bone / np.linalg.norm(bone) for bone in limb.bones(body.joint_template))
    rotvecs = rng.normal(size=(2, 3))
    R_upper, R_hinge = from_rotvec(rotvecs)
    roll, twist = (grid.reshape(-1, 1) for grid in np.meshgrid(ROLLS_RAD, ROLLS_RAD))
    turn = from_rotvec(roll * upper_bone)
    every = np.stack([
        to_rotvec(R_upper @ turn),
        to_rotvec(turn.transpose(0, 2, 1) @ R_hinge @ from_rotvec(twist * lower_bone))], axis=1)
    c = to_swing_twist(every, TWIST_AXES[rows])
    excess = np.maximum(c - UPPER[rows], 0.0) + np.minimum(c - LOWER[rows], 0.0)
    cheapest = every[np.argmin((excess**2 + EASE * c**2).sum(axis=(1, 2)))]
    np.testing.assert_allclose(
        easiest_reading(limb, rotvecs, body.joint_template), cheapest, atol=1e-9)
