"""Bodies turned about, or with legs exchanged: joints go where those of the other side were."""

import numpy as np
import pytest
from support.one_person import facing_person

from pop_core.body.joint_limits import mirrored_pose
from pop_core.body.joints import JOINT_INDEX, MIRROR
from pop_core.body.kinematics import joint_rotations, joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.bone_rolls import rolled_limbs
from pop_core.fitting.side_exchange import LEGS, turned_around, with_legs_exchanged
from pop_core.synthesis.poses import draw_pose

LIMB_JOINTS = [JOINT_INDEX[f'{side}_{name}'] for side in ('left', 'right')
               for name in ('knee', 'ankle', 'elbow', 'wrist')]
KNEES_AND_ANKLES = [joint for limb in LEGS for joint in (limb.hinge, limb.end)]


@pytest.fixture
def walker(person: BodyParameters) -> BodyParameters:
    """Left leg forward, right leg back, arms bent."""
    pose = person.body_pose.copy()
    for limb, swing, bend in zip(LEGS, (-0.6, 0.4), (0.3, 0.5), strict=True):
        pose[limb.upper - 1, 0], pose[limb.hinge - 1, 0] = swing, bend
    return person.replaced(body_pose=pose)


def test_a_turned_body_has_its_joints_where_the_other_side_was(
    body: BodyModel, walker: BodyParameters
) -> None:
    turned = turned_around(body, walker)
    off = joints(body, turned)[LIMB_JOINTS] - joints(body, walker)[MIRROR][LIMB_JOINTS]
    # Shoulders and hips lie a little before or behind the axis that the body turns about.
    assert np.linalg.norm(off, axis=1).max() < 0.04


def test_a_turned_body_looks_the_other_way_and_stands_as_upright(
    body: BodyModel, walker: BodyParameters
) -> None:
    before, after = (joint_rotations(body, p) for p in (walker, turned_around(body, walker)))
    for name in ('pelvis', 'spine3', 'head'):
        joint = JOINT_INDEX[name]
        np.testing.assert_allclose(after[joint][:, 1], before[joint][:, 1], atol=1e-9)
        np.testing.assert_allclose(after[joint][:, 2], -before[joint][:, 2], atol=1e-9)


def test_a_body_turned_twice_is_back(body: BodyModel) -> None:
    """Somebody who stands nearly straight can stand either way round."""
    standing = facing_person(np.zeros(10))
    back = turned_around(body, turned_around(body, standing))
    assert np.linalg.norm(joints(body, back) - joints(body, standing), axis=1).max() < 0.05


def test_exchanged_legs_stand_where_the_others_stood(
    body: BodyModel, walker: BodyParameters
) -> None:
    exchanged = with_legs_exchanged(body, walker)
    off = joints(body, exchanged)[KNEES_AND_ANKLES] - joints(body, walker)[MIRROR][
        KNEES_AND_ANKLES]
    # Each leg now starts at the other hip and has to cross over.
    assert np.linalg.norm(off, axis=1).max() < 0.09
    assert rolled_limbs(exchanged.body_pose) == []
    legs = [row for limb in LEGS for row in (limb.upper - 1, limb.hinge - 1, limb.end - 1)]
    others = np.setdiff1d(np.arange(23), legs)
    np.testing.assert_array_equal(exchanged.body_pose[others], walker.body_pose[others])


def test_readings_of_a_mirrored_body_are_mirrored(body: BodyModel) -> None:
    rng = np.random.default_rng(2)
    pose = draw_pose(body, 'walking', rng).body_pose
    at_rest = BodyParameters(np.zeros(3), np.zeros(3), pose, np.zeros(10))
    in_mirror = at_rest.replaced(body_pose=mirrored_pose(pose))
    for read in (turned_around, with_legs_exchanged):
        first, second = (joints(body, read(body, each)) for each in (at_rest, in_mirror))
        # Rolls are chosen from a grid, which moves feet and hands a little.
        np.testing.assert_allclose(first[LIMB_JOINTS],
                                   second[MIRROR][LIMB_JOINTS] * [-1, 1, 1], atol=1e-3)
