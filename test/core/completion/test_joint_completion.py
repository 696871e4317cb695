"""The embedded completion network knows people, and says how well."""

from dataclasses import replace

import numpy as np
import pytest
from support.onnx_files import save_network

from pop_core.body.default_body import default_body
from pop_core.body.joints import SHARED_MIRROR
from pop_core.completion.joint_completion import JointCompletion, load_completion
from pop_core.errors import NetworkShapeError
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.upright import points_turned_back, turned_back, upright_frame
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.scenes import synthesise_scene

SEEDS = range(70, 82)


@pytest.fixture(scope='module')
def completion() -> JointCompletion:
    return load_completion()


@pytest.fixture(scope='module')
def told(completion):
    """Return error, stated spread and visibility of every joint of some scenes' people."""
    rows = []
    for seed in SEEDS:
        scene = synthesise_scene(default_body(), seed, SceneConfig(colour=False))
        for person, detection in zip(scene.people, scene.detections(), strict=True):
            belief = completion.expected(scene.frame, detection)
            off = np.linalg.norm(belief.positions_camera - person.shared_points, axis=1)
            seen = person.shared_state == JointState.VISIBLE
            rows.append(np.column_stack([off, belief.sigma_m, seen]))
    return np.concatenate(rows).T


def test_joints_are_where_it_says(told):
    off_m, _, seen = told
    assert np.median(off_m[seen > 0]) < 0.05
    assert np.median(off_m[seen == 0]) < 0.15


def test_it_knows_how_far_off_it_may_be(told):
    off_m, sigma_m, seen = told
    assert sigma_m[seen > 0].mean() < 0.6 * sigma_m[seen == 0].mean()
    # Of a distribution as it states them, half of all errors are within 1.34 of its sigmas.
    assert 0.7 < np.median(off_m / sigma_m) < 2.0


def test_it_is_surer_where_left_and_right_are_named_rightly(completion):
    surer = []
    for seed in SEEDS:
        scene = synthesise_scene(default_body(), seed, SceneConfig(colour=False))
        for detection in scene.detections():
            named, exchanged = (
                completion.expected(scene.frame, way).vagueness
                for way in (detection, detection.with_sides_exchanged()))
            surer.append(named < exchanged)
    assert np.mean(surer) > 0.9


def test_a_mirrored_person_has_mirrored_joints(completion):
    scene = synthesise_scene(default_body(), SEEDS[0], SceneConfig(colour=False))
    detection, camera = scene.detections()[0], scene.frame.camera
    here = completion.expected(scene.frame, detection)
    other = Camera(camera.width, camera.height, camera.fx, camera.fy,
                   camera.width - 1 - camera.cx, camera.cy)
    pixels = detection.keypoints_px[SHARED_MIRROR]
    pixels = np.column_stack([camera.width - 1 - pixels[:, 0], pixels[:, 1]])
    left, top, right, bottom = detection.box_px
    box = np.array([camera.width - 1 - right, top, camera.width - 1 - left, bottom])
    mirrored = Detection(pixels, detection.scores[SHARED_MIRROR], box)
    frame = replace(
        scene.frame, depth_m=np.ascontiguousarray(scene.frame.depth_m[:, ::-1]), camera=other)
    there = completion.expected(frame, mirrored).with_sides_exchanged()
    expected = here.positions_camera * [-1.0, 1.0, 1.0]
    assert np.median(np.linalg.norm(there.positions_camera - expected, axis=1)) < 0.04


@pytest.mark.parametrize('turns', [1, 2, 3])
def test_cameras_on_their_side_see_the_same(completion, turns):
    scene = synthesise_scene(default_body(), SEEDS[0], SceneConfig(colour=False))
    detection, upright = scene.detections()[0], scene.frame
    camera = upright.camera
    for _ in range(4 - turns):  # what the upright image is turned from
        camera = camera.turned()
    mounted = RgbdFrame(
        np.rot90(upright.rgb, -turns), np.ascontiguousarray(np.rot90(upright.depth_m, -turns)),
        replace(camera, quarter_turns=turns), upright.stamp_ns)
    assert upright_frame(mounted).camera.sees_like(upright.camera)
    there = completion.expected(mounted, turned_back(detection, mounted.camera))
    here = completion.expected(upright, detection)
    back = points_turned_back(here.positions_camera, mounted.camera)
    assert np.allclose(there.positions_camera, back, atol=1e-3)
    assert np.allclose(
        mounted.camera.project(back), turned_back(
            replace(detection, keypoints_px=upright.camera.project(here.positions_camera)),
            mounted.camera).keypoints_px, atol=1e-6)


def test_nobody_is_expected_where_nothing_was_measured(completion):
    scene = synthesise_scene(default_body(), SEEDS[0], SceneConfig(colour=False))
    nothing = np.full_like(scene.frame.depth_m, np.nan)
    empty = replace(scene.frame, depth_m=nothing)
    assert completion.expected(empty, scene.detections()[0]) is None


def test_another_network_is_refused(tmp_path):
    path = save_network(tmp_path / 'other.onnx', {'places': np.zeros((1, 15, 3), np.float32)})
    with pytest.raises(NetworkShapeError, match='expected a completion network'):
        load_completion(path)


def test_a_network_that_says_no_numbers_is_told(completion, monkeypatch):
    scene = synthesise_scene(default_body(), SEEDS[0], SceneConfig(colour=False))
    says = [np.full((1, 15, 3), np.nan, np.float32), np.zeros((1, 15), np.float32)]
    monkeypatch.setattr(completion.session, 'run', lambda *_: says)
    with pytest.raises(NetworkShapeError, match='expected numbers'):
        completion.expected(scene.frame, scene.detections()[0])


def test_nothing_is_told_to_the_millimetre(completion, monkeypatch):
    scene = synthesise_scene(default_body(), SEEDS[0], SceneConfig(colour=False))
    says = [np.zeros((1, 15, 3), np.float32), np.full((1, 15), -1000.0, np.float32)]
    monkeypatch.setattr(completion.session, 'run', lambda *_: says)
    belief = completion.expected(scene.frame, scene.detections()[0])
    assert (belief.sigma_m == 0.01).all()
