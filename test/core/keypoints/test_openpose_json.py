import json

import numpy as np
import pytest

from pop_core.body.joints import BODY_25_OF_SHARED, N_SHARED, SHARED_INDEX, SHARED_NAMES
from pop_core.errors import KeypointFileError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.keypoint_sets import (
    COCO_17,
    COCO_18,
    HALPE_26,
    WHOLEBODY_133,
    shared_joints,
)
from pop_core.keypoints.neck import with_smpl_neck
from pop_core.keypoints.openpose_json import (
    FileDetector,
    NoKeypointsError,
    OpenPoseJsonDetector,
    read_openpose_json,
    write_openpose_json,
)
from pop_core.keypoints.people import detection_of
from pop_core.rgbd import RgbdFrame


def people(rng, n=3):
    out = []
    for _ in range(n):
        scores = rng.uniform(0.1, 1.0, N_SHARED)
        scores[rng.random(N_SHARED) < 0.3] = 0.0
        scores[0] = 0.9
        keypoints_px = rng.uniform(10, 600, (N_SHARED, 2))
        # Necks have two places, which a reader tells apart by the shoulders: take SMPL's.
        shoulders = [SHARED_INDEX['left_shoulder'], SHARED_INDEX['right_shoulder']]
        keypoints_px[SHARED_INDEX['neck']] = keypoints_px[shoulders].mean(axis=0)
        given = detection_of(keypoints_px, scores)
        out.append(detection_of(with_smpl_neck(given.keypoints_px), scores))
    return sorted(out, key=lambda person: -person.score)


def frame_of(stamp_ns):
    camera = Camera(4, 3, 5.0, 5.0, 1.5, 1.0)
    rgb, depth_m = np.zeros((3, 4, 3), np.uint8), np.ones((3, 4), np.float32)
    return RgbdFrame(rgb, depth_m, camera, stamp_ns)


def write(path, person):
    document = {'version': 1.3, 'people': [{'pose_keypoints_2d': person}]}
    path.write_text(json.dumps(document))
    return path


def test_people_survive_a_round_trip_through_a_file(tmp_path):
    before = people(np.random.default_rng(0))
    write_openpose_json(tmp_path / 'k.json', before)
    after = read_openpose_json(tmp_path / 'k.json')
    assert len(after) == len(before)
    for a, b in zip(after, before, strict=True):
        # The file keeps four decimals.
        np.testing.assert_allclose(a.keypoints_px, b.keypoints_px, atol=1e-4)
        np.testing.assert_allclose(a.scores, b.scores, atol=1e-4)


def test_each_body_25_row_lands_on_its_joint(tmp_path):
    # BODY_25: 0 nose, 1 neck, 2-4 right arm, 5-7 left arm, 8 mid hip, 9-11 right leg, 12-14 left.
    rows = np.column_stack([np.arange(25) + 100.0, np.arange(25) + 200.0, np.full(25, 0.5)])
    person = read_openpose_json(write(tmp_path / 'k.json', rows.ravel().tolist()))[0]
    expected = {'head': 0, 'right_wrist': 4, 'left_elbow': 6, 'pelvis': 8,
                'right_hip': 9, 'right_ankle': 11, 'left_knee': 13}
    for name, row in expected.items():
        assert person.keypoints_px[SHARED_INDEX[name]].tolist() == [100.0 + row, 200.0 + row]


@pytest.mark.parametrize(
    'keypoints', [COCO_17, COCO_18, HALPE_26, WHOLEBODY_133], ids=lambda k: k.name)
def test_other_sets_are_told_by_their_number_of_keypoints(tmp_path, keypoints):
    rng = np.random.default_rng(3)
    px, scores = rng.uniform(10, 600, (len(keypoints), 2)), rng.uniform(0.1, 1, len(keypoints))
    rows = np.column_stack([px, scores]).ravel().tolist()
    (person,) = read_openpose_json(write(tmp_path / 'k.json', rows))
    expected_px, expected_scores = shared_joints(keypoints, px, scores)
    np.testing.assert_array_equal(person.keypoints_px, expected_px)
    np.testing.assert_array_equal(person.scores, expected_scores)


def test_each_coco_18_row_of_openpose_lands_on_its_joint(tmp_path):
    # poseParameters.cpp: 0 nose, 1 neck, 2-4 right arm, 5-7 left arm, 8-10 right leg, 11-13 left.
    rows = np.column_stack([np.arange(18) + 100.0, np.arange(18) + 200.0, np.full(18, 0.5)])
    (person,) = read_openpose_json(write(tmp_path / 'k.json', rows.ravel().tolist()))
    expected = {'head': 0, 'right_wrist': 4, 'left_elbow': 6, 'right_hip': 8, 'right_ankle': 10,
                'left_hip': 11, 'left_knee': 12}
    for name, row in expected.items():
        assert person.keypoints_px[SHARED_INDEX[name]].tolist() == [100.0 + row, 200.0 + row]
    assert person.keypoints_px[SHARED_NAMES.index('pelvis')].tolist() == [109.5, 209.5]


def test_people_of_one_file_may_be_of_different_sets(tmp_path):
    rng = np.random.default_rng(4)
    people = [{'pose_keypoints_2d': rng.uniform(2, 600, 3 * n).tolist()} for n in (17, 25)]
    (tmp_path / 'k.json').write_text(json.dumps({'people': people}))
    assert len(read_openpose_json(str(tmp_path / 'k.json'))) == 2


def test_zeros_are_undetected_keypoints(tmp_path):
    rows = np.zeros((25, 3))
    rows[BODY_25_OF_SHARED[:4]] = [50.0, 60.0, 0.8]
    person = read_openpose_json(write(tmp_path / 'k.json', rows.ravel().tolist()))[0]
    assert np.isnan(person.keypoints_px[4:]).all()
    assert person.scores[4:].max() == 0.0
    left, top, right, bottom = person.box_px
    assert left <= 50 <= right
    assert top <= 60 <= bottom


def test_a_person_of_zeros_is_nobody(tmp_path):
    assert read_openpose_json(write(tmp_path / 'k.json', [0] * 75)) == []


def test_an_empty_list_is_nobody(tmp_path):
    (tmp_path / 'k.json').write_text('{"people": []}')
    assert read_openpose_json(tmp_path / 'k.json') == []


def test_scores_stay_within_one(tmp_path):
    rows = np.tile([50.0, 60.0, 1.02], (25, 1))
    person = read_openpose_json(write(tmp_path / 'k.json', rows.ravel().tolist()))[0]
    assert person.scores.max() == 1.0


@pytest.mark.parametrize(('text', 'told'), [
    ('', 'expected OpenPose JSON'),
    ('{"people": [', 'expected OpenPose JSON'),
    ('[' * 100_000, 'expected OpenPose JSON'),
    ('[1, 2]', "a list 'people'"),
    ('{"people": 3}', "a list 'people'"),
    ('{"people": [7]}', "a list 'pose_keypoints_2d'"),
    ('{"people": [{"pose_keypoints_2d": "x"}]}', "a list 'pose_keypoints_2d'"),
    ('{"people": [{"pose_keypoints_2d": [NaN]}]}', 'NaN'),
    ('{"people": [{"pose_keypoints_2d": [' + '1,' * 74 + '1e999]}]}', 'found inf'),
    ('{"people": [{"pose_keypoints_2d": [' + '1,' * 74 + '"a"]}]}', "found 'a'"),
    ('{"people": [{"pose_keypoints_2d": [' + '1,' * 44 + '1]}]}', 'found 45 numbers (MPI-15)'),
    ('{"people": [{"pose_keypoints_2d": [' + '1,' * 51 + '1]}]}', '17 (COCO-17), 18 (COCO-18)'),
    ('{"people": [{"pose_keypoints_2d": [' + '9' * 5000 + ']}]}', 'expected OpenPose JSON'),
    ('{"people": [{"pose_keypoints_2d": [' + '0.5,' * 74 + '0.5]}]}', 'keypoint_scale'),
])
def test_a_damaged_file_is_told_in_one_line(tmp_path, text, told):
    path = tmp_path / 'bad.json'
    path.write_text(text)
    with pytest.raises(KeypointFileError) as error:
        read_openpose_json(path)
    message = str(error.value)
    assert message.startswith(str(path))
    assert told in message
    assert '\n' not in message
    assert len(message) < 400


def test_bytes_that_are_no_text_are_told_in_one_line(tmp_path):
    (tmp_path / 'k.json').write_bytes(b'\xff\xfe\x00')
    with pytest.raises(KeypointFileError, match='expected OpenPose JSON'):
        read_openpose_json(tmp_path / 'k.json')


def test_a_folder_of_stamps_gives_each_frame_its_own_people(tmp_path):
    rng = np.random.default_rng(1)
    write_openpose_json(tmp_path / '1700000000000000001.json', people(rng, 1))
    write_openpose_json(tmp_path / '1700000000000000002.json', people(rng, 2))
    detector = OpenPoseJsonDetector(tmp_path)
    assert len(detector.detect(frame_of(1700000000000000001))) == 1
    assert len(detector.detect(frame_of(1700000000000000002))) == 2


def test_a_stamp_without_file_is_its_own_error(tmp_path):
    with pytest.raises(NoKeypointsError, match=r'5\.json'):
        OpenPoseJsonDetector(tmp_path).detect(frame_of(5))


def test_a_missing_folder_is_told_at_once(tmp_path):
    with pytest.raises(KeypointFileError, match='folder'):
        OpenPoseJsonDetector(tmp_path / 'nowhere')


def test_one_file_serves_every_frame(tmp_path):
    write_openpose_json(tmp_path / 'keypoints.json', people(np.random.default_rng(2), 2))
    detector = FileDetector(tmp_path / 'keypoints.json')
    assert len(detector.detect(frame_of(1))) == len(detector.detect(frame_of(2))) == 2


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(KeypointFileError, match='expected a keypoint file'):
        FileDetector(tmp_path / 'none.json')
