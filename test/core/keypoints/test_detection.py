"""Detections whose left and right are exchanged."""

from typing import Any

import numpy as np
import pytest

from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.errors import DetectionError
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


@pytest.mark.parametrize(('changes', 'told'), [
    ({'keypoints_px': np.zeros((17, 2)), 'scores': np.ones(17)}, r'keypoints_px .*\(17, 2\)'),
    ({'scores': np.ones(17)}, r'scores of shape \(15,\).*\(17,\): .*detections_of'),
    ({'keypoints_px': np.zeros((15, 3))}, r'keypoints_px .*found \(15, 3\)'),
    ({'box_px': np.zeros(5)}, r'box_px of shape \(4,\)'),
    ({'visible': np.ones(24)}, r'visible .*found \(24,\)'),
])
def test_rows_of_another_number_of_joints_are_refused_at_once(
    changes: dict[str, Any], told: str
) -> None:
    good = {'keypoints_px': np.zeros((15, 2)), 'scores': np.ones(15), 'box_px': np.zeros(4)}
    with pytest.raises(DetectionError, match=told):
        unchecked(**(good | changes))


def unchecked(**values: Any) -> None:
    """Check a detection as users have it, without the types that tests are checked with."""
    detection = object.__new__(Detection)
    optional = dict.fromkeys(('joint_depth_m', 'joint_sigma_m', 'visible'))
    for name, value in (optional | values).items():
        object.__setattr__(detection, name, value)
    detection.__post_init__()
