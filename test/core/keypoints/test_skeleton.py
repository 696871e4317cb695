import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import rest_parameters, shared_points
from pop_core.keypoints.lifted_joints import LiftState
from pop_core.keypoints.skeleton import BONE_M, ORDER, PATH_M, TREE_PARENT, linked
from pop_core.keypoints.skeleton_checks import (
    with_guessed_limbs,
    without_broken_bones,
    without_guessed_nose,
    without_hidden_limbs,
)
from pop_core.keypoints.skin_offsets import facing, skin_to_joint_m

ROW = SHARED_INDEX


def rest_points():
    model = default_body()
    return attached_positions(shared_points(model), model, rest_parameters())


def test_bones_are_as_long_as_those_of_the_default_body():
    points = rest_points()
    child = np.flatnonzero(TREE_PARENT >= 0)
    length = np.linalg.norm(points[child] - points[TREE_PARENT[child]], axis=1)
    np.testing.assert_allclose(BONE_M[child], length, atol=0.01)


def test_paths_are_symmetric_and_add_up_along_the_tree():
    assert np.array_equal(PATH_M, PATH_M.T)
    assert np.all(np.diag(PATH_M) == 0)
    arm = ('neck', 'left_shoulder', 'left_elbow', 'left_wrist')
    assert PATH_M[ROW['neck'], ROW['left_wrist']] == pytest.approx(
        sum(BONE_M[ROW[name]] for name in arm[1:]))
    assert PATH_M[ROW['left_ankle'], ROW['right_ankle']] == pytest.approx(
        2 * sum(BONE_M[ROW[f'left_{name}']] for name in ('hip', 'knee', 'ankle')))


def test_with_every_joint_present_the_links_are_the_tree():
    assert np.array_equal(linked(np.ones(15, bool)), TREE_PARENT)


def test_a_missing_joint_is_bridged():
    present = np.ones(15, bool)
    present[[ROW['left_elbow'], ROW['pelvis']]] = False
    links = linked(present)
    assert links[ROW['left_wrist']] == ROW['left_shoulder']
    assert links[ROW['left_hip']] == ROW['neck']
    assert links[ROW['neck']] == links[ROW['pelvis']] == links[ROW['left_elbow']] == -1


@pytest.mark.parametrize('seed', range(10))
def test_links_form_one_tree_whose_parents_come_first(seed):
    present = np.random.default_rng(seed).random(15) < 0.5
    links = linked(present)
    assert np.count_nonzero(present & (links < 0)) == min(1, present.sum())
    seen = set()
    for j in ORDER[present[ORDER]]:
        assert links[j] < 0 or int(links[j]) in seen
        seen.add(int(j))


def visible():
    return np.full(15, int(LiftState.VISIBLE))


def test_of_a_broken_bone_the_leaf_with_no_other_bone_is_wrong():
    points = rest_points()
    points[ROW['left_wrist']] += [0.0, 0.0, 2.0]
    state = without_broken_bones(points, np.full(15, 0.9), visible(), 1.2)
    assert state[ROW['left_wrist']] == LiftState.OUTLIER
    assert np.count_nonzero(state != LiftState.VISIBLE) == 1


def test_a_wrong_joint_between_right_ones_takes_the_blame():
    points = rest_points()
    points[ROW['right_knee']] += [0.0, 0.0, 1.5]
    state = without_broken_bones(points, np.full(15, 0.9), visible(), 1.2)
    assert np.flatnonzero(state != LiftState.VISIBLE).tolist() == [ROW['right_knee']]


def test_a_body_whose_bones_hold_is_left_alone():
    points, scores = rest_points(), np.full(15, 0.9)
    state = without_broken_bones(points, scores, visible(), 1.2)
    state = without_hidden_limbs(points, scores, state, 1.0)
    assert (state == LiftState.VISIBLE).all()


def test_of_two_limbs_in_one_place_the_less_certain_is_hidden():
    points, scores = rest_points(), np.full(15, 0.9)
    points[ROW['left_ankle']] = points[ROW['right_ankle']] + [0.0, 0.0, 0.01]
    scores[ROW['left_ankle']] = 0.4
    state = without_hidden_limbs(points, scores, visible(), 1.0)
    assert np.flatnonzero(state == LiftState.OCCLUDED).tolist() == [ROW['left_ankle']]


def test_a_forearm_without_length_hides_its_less_certain_end():
    points, scores = rest_points(), np.full(15, 0.9)
    points[ROW['left_wrist']] = points[ROW['left_elbow']] + [0.02, 0.0, 0.02]
    scores[ROW['left_wrist']] = 0.4
    state = without_hidden_limbs(points, scores, visible(), 1.0)
    assert np.flatnonzero(state == LiftState.OCCLUDED).tolist() == [ROW['left_wrist']]


def test_a_thigh_without_length_hides_the_hip_behind_the_knee():
    points = rest_points()
    points[ROW['left_knee']] = points[ROW['left_hip']] + [0.0, 0.02, 0.05]
    points[ROW['left_ankle']] = points[ROW['left_knee']] + [0.0, -0.4, 0.0]
    state = without_hidden_limbs(points, np.full(15, 0.9), visible(), 1.0)
    assert np.flatnonzero(state == LiftState.OCCLUDED).tolist() == [ROW['left_hip']]


@pytest.mark.parametrize('sure', [0.9, 0.3])
def test_limbs_of_low_score_are_guessed_whatever_scores_are_usual(sure):
    scores = np.full(15, sure)
    guessed = [ROW['left_elbow'], ROW['left_wrist']]
    scores[guessed] = 0.4 * sure
    scores[ROW['pelvis']] = 0.4 * sure  # a trunk is where its surface is
    state = with_guessed_limbs(scores, visible())
    assert np.flatnonzero(state == LiftState.GUESSED).tolist() == guessed


def test_guesses_count_as_seen_where_little_else_was():
    state = np.full(15, int(LiftState.MISSING))
    state[[ROW[name] for name in ('neck', 'left_shoulder', 'right_shoulder', 'left_elbow')]] = 0
    scores = np.where(state == LiftState.VISIBLE, 0.9, 0.0)
    scores[ROW['left_elbow']] = 0.2
    assert np.array_equal(with_guessed_limbs(scores, state), state)
    assert np.array_equal(with_guessed_limbs(np.zeros(15), state), state)


def test_a_doubtful_nose_of_a_person_turned_away_is_hidden():
    nose, scores = ROW['head'], np.full(15, 0.3)
    assert without_guessed_nose(scores, visible(), -0.9)[nose] == LiftState.OCCLUDED
    assert without_guessed_nose(scores, visible(), 0.9)[nose] == LiftState.VISIBLE
    assert without_guessed_nose(scores, visible(), None)[nose] == LiftState.VISIBLE
    assert without_guessed_nose(scores + 0.6, visible(), -0.9)[nose] == LiftState.VISIBLE


def image_of(yaw):
    """The default body from a side, far away, as pixels of a millimetre."""
    points = rest_points()
    turn = np.array([[np.cos(yaw), 0, np.sin(yaw)], [0, 1, 0], [-np.sin(yaw), 0, np.cos(yaw)]])
    return (points @ turn.T)[:, :2] * [1000.0, -1000.0]


@pytest.mark.parametrize('yaw', np.linspace(-3, 3, 9))
def test_facing_is_the_cosine_of_the_turn(yaw):
    assert facing(image_of(yaw), 1e-3) == pytest.approx(np.cos(yaw), abs=0.12)


def test_facing_does_not_depend_on_the_roll_of_the_camera():
    uv = image_of(0.5)
    roll = np.array([[np.cos(0.7), -np.sin(0.7)], [np.sin(0.7), np.cos(0.7)]])
    assert facing(uv @ roll.T, 1e-3) == pytest.approx(facing(uv, 1e-3), abs=1e-9)


def test_facing_is_unknown_without_shoulders_and_hips():
    uv = image_of(0.5)
    uv[[ROW[f'{side}_{part}'] for side in ('left', 'right') for part in ('hip', 'shoulder')]] = (
        np.nan)
    assert facing(uv, 1e-3) is None
    offset, spread = skin_to_joint_m(None)
    assert (spread >= skin_to_joint_m(1.0)[1] - 1e-12).all()
    assert np.isfinite(offset).all()


def test_left_and_right_lie_equally_deep():
    offset, _ = skin_to_joint_m(0.3)
    for name in ('hip', 'knee', 'ankle', 'shoulder', 'elbow', 'wrist'):
        assert offset[ROW[f'left_{name}']] == offset[ROW[f'right_{name}']]
