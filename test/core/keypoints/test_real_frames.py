"""Real networks on real frames; skipped where the shared data is not there."""

import numpy as np
import pytest
from support.real_frames import DATA, SOFA, load

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.fusion import FusedDetector
from pop_core.keypoints.lifting import lift_keypoints
from pop_core.keypoints.onnx_detector import load_source

NETWORK = DATA / 'models' / 'posenet_mobilenet_v1_075_481_641_dequant.onnx'
CLOSER = DATA / 'models' / 'EfficientPoseII.onnx'


@pytest.fixture(scope='module')
def detector():
    if not NETWORK.is_file():
        pytest.skip(f'looked for {NETWORK}')
    return load_source(NETWORK)


def test_five_people_are_five(detector):
    frame = load('five_people')
    people = detector.detect(frame)
    assert len(people) == 5
    pelvis = [lift_keypoints(frame, p).positions_camera[0] for p in people]
    # Two pairs within arm's length, nobody in the place of another.
    gaps = [np.linalg.norm(a - b) for i, a in enumerate(pelvis) for b in pelvis[:i]]
    assert min(gaps) > 0.3
    assert all(1.6 < p[2] < 3.2 for p in pelvis)


def test_an_empty_office_holds_nobody(detector):
    assert detector.detect(load('office_empty')) == []


@pytest.mark.parametrize('number', SOFA)
def test_one_man_sits_on_the_sofa(detector, number):
    frame = load(f'sofa_pointing/{number}')
    people = detector.detect(frame)
    assert len(people) == 1
    lifted = lift_keypoints(frame, people[0])
    assert lifted.lifted.sum() >= 12
    knees = [SHARED_INDEX['left_knee'], SHARED_INDEX['right_knee']]
    torso = lifted.positions_camera[SHARED_INDEX['neck']]
    # Seated: knees nearer to the camera than the shoulders.
    assert np.nanmedian(lifted.positions_camera[knees, 2]) < torso[2] + 0.1


@pytest.fixture(scope='module')
def fused(detector):
    if not CLOSER.is_file():
        pytest.skip(f'looked for {CLOSER}')
    return FusedDetector([detector], top_down=[load_source(CLOSER)])


def test_a_second_network_adds_joints_and_no_people(detector, fused):
    frame = load('five_people')
    alone, merged = detector.detect(frame), fused.detect(frame)
    assert len(merged) == 5
    lifted = [[int(lift_keypoints(frame, person).lifted.sum()) for person in people]
              for people in (alone, merged)]
    assert sum(lifted[1]) >= sum(lifted[0])
    assert fused.detect(load('office_empty')) == []


def test_a_knee_that_one_network_misses_is_found_by_the_other(detector, fused):
    frame = load('sofa_pointing/30')
    knee = SHARED_INDEX['right_knee']
    (alone,), (merged,) = detector.detect(frame), fused.detect(frame)
    assert alone.scores[knee] == 0.0
    assert merged.scores[knee] > 0.2
    both = alone.scores > 0
    # Where both know a joint, it stays on the same limb.
    gap = np.linalg.norm(merged.keypoints_px[both] - alone.keypoints_px[both], axis=1)
    assert np.median(gap) < 20.0
