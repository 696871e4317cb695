"""Detections whose left and right are exchanged."""

import numpy as np

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.keypoints.detection import Detection

LEFT, RIGHT = SHARED_INDEX['left_wrist'], SHARED_INDEX['right_wrist']


def detection() -> Detection:
    n = np.arange(15, dtype=np.float64)
    labels = np.array([[-1, JOINT_INDEX['left_knee'], JOINT_INDEX['head']]], dtype=np.int8)
    return Detection(
        np.column_stack([n, 10 + n]), n / 15, np.zeros(4), joint_depth_m=n, part_labels=labels)


def test_every_joint_and_part_changes_its_side() -> None:
    before, after = detection(), detection().with_sides_exchanged()
    np.testing.assert_array_equal(after.keypoints_px[LEFT], before.keypoints_px[RIGHT])
    assert after.scores[LEFT] == before.scores[RIGHT]
    assert after.joint_depth_m is not None
    assert after.joint_depth_m[LEFT] == RIGHT
    assert after.visible is None
    np.testing.assert_array_equal(
        after.part_labels, [[-1, JOINT_INDEX['right_knee'], JOINT_INDEX['head']]])


def test_exchanging_twice_changes_nothing() -> None:
    before, after = detection(), detection().with_sides_exchanged().with_sides_exchanged()
    np.testing.assert_array_equal(after.keypoints_px, before.keypoints_px)
    np.testing.assert_array_equal(after.part_labels, before.part_labels)
