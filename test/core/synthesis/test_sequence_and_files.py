import json

import cv2
import numpy as np
import pytest

from pop_core.estimate import JointState
from pop_core.keypoints.openpose_json import read_openpose_json
from pop_core.synthesis.contact_sheet import contact_sheet
from pop_core.synthesis.scene_files import depth_mm, save_scene
from pop_core.synthesis.sequence import synthesise_sequence


@pytest.fixture(scope='module')
def walk(model):
    return synthesise_sequence(model, 0, 9, rate_hz=5.0)


def test_stamps_of_a_sequence_are_one_period_apart(walk):
    stamps = [scene.frame.stamp_ns for scene in walk]
    assert np.diff(stamps).tolist() == [200_000_000] * 8


def test_the_walker_crosses_the_image_from_left_to_right(walk):
    pelvis = np.array([scene.people[0].joints[0] for scene in walk])
    assert (np.diff(pelvis[:, 0]) > 0.1).all()
    assert walk[0].frame.camera.project(pelvis[[0]])[0, 0] < 320
    assert walk[-1].frame.camera.project(pelvis[[-1]])[0, 0] > 320


def test_the_table_hides_joints_of_the_walker(walk):
    hidden = [(s.people[0].joint_state == JointState.SCENE_OCCLUDED).sum() for s in walk]
    assert max(hidden) >= 4
    assert all((s.people[0].shared_state == JointState.VISIBLE).sum() >= 5 for s in walk)


def test_room_and_camera_stand_still(walk):
    still = ~np.any([scene.people[0].amodal_mask for scene in walk], axis=0)
    assert np.array_equal(walk[0].true_depth_m[still], walk[-1].true_depth_m[still])
    assert np.array_equal(walk[0].people[0].parameters.betas, walk[-1].people[0].parameters.betas)


def test_saved_scenes_hold_what_was_synthesised(scenes, tmp_path):
    scene = scenes[2]
    save_scene(scene, tmp_path)
    colour = cv2.imread(str(tmp_path / 'color.png'))[..., ::-1]
    assert np.array_equal(colour, scene.frame.rgb)
    depth = cv2.imread(str(tmp_path / 'depth.png'), cv2.IMREAD_UNCHANGED)
    assert depth.dtype == np.uint16
    known = np.isfinite(scene.frame.depth_m)
    assert np.array_equal(depth > 0, known)
    # Half a millimetre of rounding.
    assert np.abs(depth[known] / 1000 - scene.frame.depth_m[known]).max() <= 0.00051
    camera = json.loads((tmp_path / 'camera.json').read_text())
    assert camera['fx'] == scene.frame.camera.fx
    truth = np.load(tmp_path / 'truth.npz')
    assert np.array_equal(truth['joints'], [person.joints for person in scene.people])
    assert np.array_equal(truth['mask'], [person.mask for person in scene.people])


def test_saved_keypoints_are_the_detections(scenes, tmp_path):
    save_scene(scenes[0], tmp_path)
    found = [d for d in scenes[0].detections() if d is not None]
    read = read_openpose_json(tmp_path / 'keypoints.json')
    for a, b in zip(sorted(found, key=lambda d: -d.score), read, strict=True):
        assert np.allclose(a.keypoints_px, b.keypoints_px, atol=1e-3, equal_nan=True)


def test_missing_depth_is_zero_millimetres():
    depth_m = np.array([[np.nan, np.inf, 1.2345, 90.0]], np.float32)
    assert depth_mm(depth_m).tolist() == [[0, 0, 1234, 65535]]


def test_a_contact_sheet_shows_every_scene(scenes):
    sheet = contact_sheet(scenes[:4])
    assert sheet.shape == (480, 1920, 3)
    assert sheet[240:480, :640].any()
    assert not sheet[240:480, 640:].any()
