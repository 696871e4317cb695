import numpy as np

from pop_core.body.joints import COCO_17_NAMES, SHARED_INDEX
from pop_core.keypoints.coco17 import shared_from_coco17

ROW = {name: row for row, name in enumerate(COCO_17_NAMES)}


def test_named_joints_are_copied_and_the_nose_stands_for_the_head():
    rng = np.random.default_rng(0)
    uv, scores = rng.uniform(0, 600, (17, 2)), rng.uniform(0.1, 1, 17)
    shared, shared_scores = shared_from_coco17(uv, scores)
    for name in ('left_wrist', 'right_ankle', 'left_shoulder', 'right_hip'):
        assert np.array_equal(shared[SHARED_INDEX[name]], uv[ROW[name]])
    assert np.array_equal(shared[SHARED_INDEX['head']], uv[ROW['nose']])
    assert shared_scores[SHARED_INDEX['head']] == scores[ROW['nose']]


def test_pelvis_and_neck_are_as_sure_as_the_worse_side():
    uv, scores = np.zeros((17, 2)), np.full(17, 0.9)
    uv[ROW['left_hip']], uv[ROW['right_hip']] = (10.0, 4.0), (20.0, 8.0)
    scores[ROW['right_hip']] = 0.3
    shared, shared_scores = shared_from_coco17(uv, scores)
    assert shared[SHARED_INDEX['pelvis']].tolist() == [15.0, 6.0]
    assert shared_scores[SHARED_INDEX['pelvis']] == 0.3
    assert shared_scores[SHARED_INDEX['neck']] == 0.9


def test_a_midpoint_needs_both_of_its_ends():
    scores = np.full(17, 0.9)
    scores[ROW['left_shoulder']] = 0.0
    shared, shared_scores = shared_from_coco17(np.ones((17, 2)), scores)
    assert shared_scores[SHARED_INDEX['neck']] == 0.0
    assert np.isnan(shared[SHARED_INDEX['neck']]).all()
