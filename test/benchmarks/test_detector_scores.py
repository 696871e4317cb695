"""The detector's benchmark: full marks for the truth, none for nothing."""

import numpy as np
import pytest

from benchmarks.detector_scores import DetectorScores, average_precision, box_iou
from pop_core.body.default_body import default_body
from pop_core.keypoints.body_parts import CLASS_OF_LABEL, LABEL_OF_CLASS
from pop_core.keypoints.detection import Detection
from pop_core.synthesis.scene_config import training_config
from pop_core.synthesis.scenes import synthesise_scene


class Oracle:
    """Says the truth of the scene it was given, a share of joints shifted by a distance."""

    def __init__(self, scene, shift_m=0.0):
        self.scene, self.shift_m = scene, shift_m

    def detect(self, frame):
        found = []
        for person in self.scene.people:
            if not person.mask.any():
                continue
            v, u = np.nonzero(person.mask)
            points = person.shared_points + [0.0, 0.0, self.shift_m]
            parts = np.where(
                person.mask, LABEL_OF_CLASS[CLASS_OF_LABEL[self.scene.part_labels]], -1)
            found.append(Detection(
                frame.camera.project(points), np.ones(15),
                np.array([u.min(), v.min(), u.max(), v.max()], float),
                joint_depth_m=points[:, 2], joint_sigma_m=np.ones(15), visible=np.ones(15),
                person_mask=person.mask, part_labels=parts.astype(np.int8)))
        return found


class Nobody:
    """Finds nobody."""

    def detect(self, _):
        return []


@pytest.fixture(scope='module')
def scenes():
    config = training_config(160, 128)
    return [synthesise_scene(default_body(), seed, config) for seed in range(6)]


def scored(scenes, make):
    scores = DetectorScores()
    for scene in scenes:
        scores.add(scene, make(scene))
    return scores.figures()


def test_the_truth_gets_full_marks(scenes):
    figures = scored(scenes, Oracle)
    for name in ('pck_visible', 'pck_hidden', 'pck_hidden_missed_too', 'ap50', 'person_iou'):
        assert figures[name] == 1.0
    assert figures['found'] == figures['people'] > 3
    assert figures['extra'] == 0


@pytest.mark.parametrize(('shift_m', 'share'), [(0.09, 1.0), (0.11, 0.0)])
def test_ten_centimetres_divide_right_from_wrong(scenes, shift_m, share):
    figures = scored(scenes, lambda scene: Oracle(scene, shift_m))
    assert figures['pck_visible'] == share
    assert figures['median_visible_m'] == pytest.approx(shift_m, rel=0.1)


def test_who_finds_nobody_gets_nothing(scenes):
    figures = scored(scenes, lambda _: Nobody())
    assert figures['ap50'] == figures['part_iou'] == figures['pck_visible_missed_too'] == 0.0


def test_average_precision_is_that_of_hand_counted_answers():
    # Right, wrong, right of three wanted: precision 1 up to a third, 2/3 up to two thirds.
    answers = [(0.9, True), (0.8, False), (0.7, True)]
    assert average_precision(answers, 3) == pytest.approx((1 + 2 / 3) / 3)
    assert average_precision([], 3) == 0.0


def test_half_of_a_box_is_half():
    a, b = np.array([0.0, 0, 9, 9]), np.array([0.0, 0, 9, 4])
    assert box_iou(a, b) == pytest.approx(0.5)
    assert box_iou(a, a + 20) == 0.0
