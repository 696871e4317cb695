"""Who stands still is expected to; what moves or is not seen may be anywhere."""

import numpy as np
import pytest

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints as joints_of
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.estimate import JointState
from pop_core.tracking.liveliness import LEAST, followed_trail, liveliness
from pop_core.tracking.motion import SPEED, motion_noise

SEEN = np.full(24, int(JointState.VISIBLE))


@pytest.fixture(scope='module')
def joints(body: BodyModel, person: BodyParameters) -> np.ndarray:
    return joints_of(body, person)


def lively_parts(share: np.ndarray) -> set[int]:
    """Return which of (translation, the 24 joints) have the usual noise."""
    per_part = share.reshape(25, 3)
    assert (per_part == per_part[:, :1]).all()
    return set(np.flatnonzero(per_part[:, 0] == 1.0).tolist())


def turns_of(*names: str) -> set[int]:
    return {1 + JOINT_INDEX[name] for name in names}


def test_nothing_of_a_statue_is_lively(joints: np.ndarray):
    np.testing.assert_array_equal(liveliness(joints, joints, SEEN), LEAST)


def test_noise_of_a_sensor_is_no_life(joints: np.ndarray):
    noise = np.random.default_rng(0).normal(scale=0.0007, size=joints.shape)
    assert liveliness(joints + noise, joints, SEEN).max() < 0.3


def test_a_forearm_that_swings_makes_elbow_and_upper_arm_lively_alone(joints: np.ndarray):
    moved = joints.copy()
    moved[[JOINT_INDEX['left_wrist'], JOINT_INDEX['left_hand']]] += [0.05, 0.0, 0.0]
    lively = turns_of('left_elbow', 'left_shoulder')  # the upper arm may turn about itself
    assert lively_parts(liveliness(moved, joints, SEEN)) == lively


def test_who_turns_round_is_lively_though_the_spine_stays(joints: np.ndarray):
    angle = 0.1
    turn = np.array([
        [np.cos(angle), 0.0, np.sin(angle)], [0.0, 1.0, 0.0],
        [-np.sin(angle), 0.0, np.cos(angle)]])
    moved = (joints - joints[0]) @ turn.T + joints[0]
    assert turns_of('pelvis') <= lively_parts(liveliness(moved, joints, SEEN))


def test_who_walks_stiffly_only_changes_place(joints: np.ndarray):
    assert lively_parts(liveliness(joints + [0.05, 0.0, 0.0], joints, SEEN)) == {0}


def test_what_nobody_sees_keeps_all_of_its_noise(joints: np.ndarray):
    state = SEEN.copy()
    state[JOINT_INDEX['right_wrist']] = int(JointState.SELF_OCCLUDED)
    assert lively_parts(liveliness(joints, joints, state)) == turns_of('right_elbow')
    state[:] = int(JointState.SCENE_OCCLUDED)
    assert lively_parts(liveliness(joints, joints, state)) == set(range(25))


def test_the_past_catches_up_with_who_stops(joints: np.ndarray):
    before = joints - [0.3, 0.0, 0.0]
    once = followed_trail(before, joints, 0.2)
    twice = followed_trail(followed_trail(before, joints, 0.1), joints, 0.1)
    np.testing.assert_allclose(once, twice)
    np.testing.assert_array_equal(followed_trail(before, joints, 0.0), before)
    np.testing.assert_allclose(followed_trail(before, joints, 10.0), joints, atol=1e-9)


def test_velocities_of_the_less_lively_settle_at_less():
    share = np.linspace(0.1, 1.0, len(SPEED))
    np.testing.assert_allclose(motion_noise(100.0, share).velocity, (share * SPEED) ** 2)
