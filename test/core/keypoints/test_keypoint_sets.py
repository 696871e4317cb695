import numpy as np
import pytest

from pop_core.body.joints import (
    BODY_25_OF_SHARED,
    COCO_17_NAMES,
    SHARED_INDEX,
    SHARED_NAMES,
    mirrored_name,
)
from pop_core.errors import DetectionError
from pop_core.keypoints.keypoint_sets import (
    BODY_25,
    COCO_17,
    COCO_18,
    HALPE_26,
    MPII_16,
    WHOLEBODY_133,
    shared_joints,
)

SETS = (BODY_25, COCO_17, COCO_18, HALPE_26, MPII_16, WHOLEBODY_133)
ROW = {name: row for row, name in enumerate(COCO_17_NAMES)}


def keypoints_of(keypoints, seed=0):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 600, (len(keypoints), 2)), rng.uniform(0.1, 1, len(keypoints))


@pytest.mark.parametrize('keypoints', SETS, ids=lambda k: k.name)
def test_joints_of_a_name_are_copied_and_the_nose_stands_for_the_head(keypoints):
    uv, scores = keypoints_of(keypoints)
    shared, shared_scores = shared_joints(keypoints, uv, scores)
    for row, name in enumerate(keypoints.names):
        joint = 'head' if name == 'nose' else name
        if joint in SHARED_INDEX:
            assert shared_scores[SHARED_INDEX[joint]] == scores[row]
            if joint != 'neck':  # it is moved to where SMPL has it
                assert np.array_equal(shared[SHARED_INDEX[joint]], uv[row])


@pytest.mark.parametrize('keypoints', SETS, ids=lambda k: k.name)
def test_every_set_gives_every_shared_joint_but_mpii_the_head(keypoints):
    _, scores = shared_joints(keypoints, *keypoints_of(keypoints))
    missing = {name for name, score in zip(SHARED_NAMES, scores, strict=True) if score == 0}
    assert missing == ({'head'} if keypoints is MPII_16 else set())


@pytest.mark.parametrize('keypoints', SETS, ids=lambda k: k.name)
def test_names_are_told_apart_and_have_their_mirror(keypoints):
    assert len(set(keypoints.names)) == len(keypoints)
    assert {mirrored_name(name) for name in keypoints.names} == set(keypoints.names)


def test_sets_have_the_sizes_of_their_names():
    assert [len(keypoints) for keypoints in SETS] == [25, 17, 18, 26, 16, 133]


def test_body_25_is_the_set_of_openpose_files():
    rows = [BODY_25.names.index('nose' if name == 'head' else name) for name in SHARED_NAMES]
    assert rows == BODY_25_OF_SHARED.tolist()


def test_pelvis_and_neck_are_as_sure_as_the_worse_side():
    uv, scores = np.zeros((17, 2)), np.full(17, 0.9)
    uv[ROW['left_hip']], uv[ROW['right_hip']] = (10.0, 4.0), (20.0, 8.0)
    scores[ROW['right_hip']] = 0.3
    shared, shared_scores = shared_joints(COCO_17, uv, scores)
    assert shared[SHARED_INDEX['pelvis']].tolist() == [15.0, 6.0]
    assert shared_scores[SHARED_INDEX['pelvis']] == 0.3
    assert shared_scores[SHARED_INDEX['neck']] == 0.9


def test_a_midpoint_needs_both_of_its_ends():
    scores = np.full(17, 0.9)
    scores[ROW['left_shoulder']] = 0.0
    shared, shared_scores = shared_joints(COCO_17, np.ones((17, 2)), scores)
    assert shared_scores[SHARED_INDEX['neck']] == 0.0
    assert np.isnan(shared[SHARED_INDEX['neck']]).all()


@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_undetected(bad):
    uv, scores = keypoints_of(COCO_17)
    uv[ROW['left_wrist'], 1] = bad
    scores[ROW['right_wrist']] = bad
    shared, shared_scores = shared_joints(COCO_17, uv, scores)
    for name in ('left_wrist', 'right_wrist'):
        assert shared_scores[SHARED_INDEX[name]] == 0.0
        assert np.isnan(shared[SHARED_INDEX[name]]).all()
    assert np.count_nonzero(shared_scores) == 13


def test_scores_stay_within_zero_and_one():
    uv, scores = keypoints_of(COCO_17)
    _, shared_scores = shared_joints(COCO_17, uv, scores * 7 - 2)
    assert shared_scores.min() >= 0.0
    assert shared_scores.max() <= 1.0


def test_keypoints_of_another_set_are_told():
    uv, scores = keypoints_of(COCO_18)
    with pytest.raises(DetectionError, match=r'COCO-17: expected .*\(17, 2\).*found .*\(18, 2\)'):
        shared_joints(COCO_17, uv, scores)
