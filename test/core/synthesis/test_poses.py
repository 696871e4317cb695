import numpy as np
import pytest

from pop_core.body.joints import JOINT_INDEX, MIRROR
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyParameters
from pop_core.synthesis.arms import reach
from pop_core.synthesis.pose_parts import limbs_clear
from pop_core.synthesis.poses import (
    POSE_KINDS,
    balancing_tilt,
    draw_pose,
    mirrored,
    walking_pose,
)


def posed_joints(model, body_pose):
    return joints(model, BodyParameters(np.zeros(3), np.zeros(3), body_pose, np.zeros(10)))


@pytest.mark.parametrize('side', ['left', 'right'])
def test_a_reachable_point_is_reached_by_the_wrist(model, side):
    sign = 1.0 if side == 'left' else -1.0
    shoulder = model.joint_template[JOINT_INDEX[f'{side}_shoulder']]
    for offset in ([0.1, -0.3, 0.2], [0.2, 0.3, 0.1], [-0.15, -0.1, 0.35]):
        target = shoulder + np.array(offset) * [sign, 1, 1]
        pose = reach(model, np.zeros((23, 3)), side, target, np.array([sign, -1.0, -0.2]))
        wrist = posed_joints(model, pose)[JOINT_INDEX[f'{side}_wrist']]
        assert np.linalg.norm(wrist - target) < 0.02  # rest arms are straight only nearly


def test_reaching_moves_one_arm_only(model):
    before = np.random.default_rng(0).normal(0, 0.1, (23, 3))
    after = reach(model, before, 'left', np.array([0.3, 0.3, 0.3]), np.array([1.0, 0.0, 0.0]))
    changed = np.flatnonzero((before != after).any(axis=1)) + 1
    assert changed.tolist() == [JOINT_INDEX['left_shoulder'], JOINT_INDEX['left_elbow']]


@pytest.mark.parametrize('kind', POSE_KINDS)
def test_mirroring_twice_changes_nothing_and_once_swaps_sides(model, kind):
    pose = draw_pose(model, kind, np.random.default_rng(4))
    assert np.array_equal(mirrored(mirrored(pose)).body_pose, pose.body_pose)
    expected = posed_joints(model, pose.body_pose)[MIRROR] * [-1.0, 1.0, 1.0]
    assert np.abs(posed_joints(model, mirrored(pose).body_pose) - expected).max() < 0.01


@pytest.mark.parametrize('kind', POSE_KINDS)
def test_limbs_of_drawn_poses_are_clear_of_each_other(model, kind):
    rng = np.random.default_rng(7)
    clear = [limbs_clear(model, draw_pose(model, kind, rng).body_pose) for _ in range(8)]
    assert sum(clear) >= 7  # an unlucky draw is kept after thirty tries


def test_a_hand_inside_the_belly_is_not_clear(model):
    belly = posed_joints(model, np.zeros((23, 3)))[JOINT_INDEX['spine1']]
    pose = reach(model, np.zeros((23, 3)), 'left', belly, np.array([1.0, 0.0, -1.0]))
    assert not limbs_clear(model, pose)


def test_knees_and_elbows_never_bend_backward(model):
    rng = np.random.default_rng(1)
    for kind in POSE_KINDS:
        pose = draw_pose(model, kind, rng).body_pose
        assert pose[JOINT_INDEX['left_knee'] - 1, 0] > 0
        assert pose[JOINT_INDEX['right_knee'] - 1, 0] > 0
        assert pose[JOINT_INDEX['left_elbow'] - 1, 1] < 0
        assert pose[JOINT_INDEX['right_elbow'] - 1, 1] > 0


def test_half_a_walking_cycle_later_the_other_leg_is_in_front(model):
    for phase in (0.3, 1.5, 4.0):
        now, later = (posed_joints(model, walking_pose(model, p)) for p in (phase, phase + np.pi))
        lead = now[JOINT_INDEX['left_ankle'], 2] - now[JOINT_INDEX['right_ankle'], 2]
        lead_later = later[JOINT_INDEX['left_ankle'], 2] - later[JOINT_INDEX['right_ankle'], 2]
        assert lead == pytest.approx(-lead_later, abs=0.01)
        assert abs(lead) > 0.05


def test_who_stands_by_the_balancing_tilt_has_the_trunk_above_the_lower_foot(model):
    pose = walking_pose(model, 0.8)
    pose[JOINT_INDEX['left_hip'] - 1] = [-1.2, 0.0, 0.0]  # one foot lifted: the other carries
    leaning = np.array([0.35, 0.0, 0.1])
    tilt = balancing_tilt(model, pose)
    p = joints(model, BodyParameters(np.zeros(3), tilt, pose, np.zeros(10)))
    before = joints(model, BodyParameters(np.zeros(3), leaning, pose, np.zeros(10)))

    def offset(points):
        trunk = points[[0, JOINT_INDEX['spine3']]].mean(axis=0)
        return np.linalg.norm((trunk - points[JOINT_INDEX['right_ankle']])[[0, 2]])

    assert offset(p) < 0.03
    assert offset(before) > 0.1
