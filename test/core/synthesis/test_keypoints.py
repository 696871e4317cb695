import numpy as np
import pytest

from pop_core.body.joints import SHARED_MIRROR
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.synthesis.keypoints import KeypointNoise, noisy_detection

CAMERA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)
VISIBLE = np.zeros(15, dtype=np.int64)
QUIET = KeypointNoise((0.0, 0.0), 0.0, 0.0, 0.0, 0.0, 0.0)


def points():
    rng = np.random.default_rng(0)
    return rng.uniform([-0.8, -0.8, 2.5], [0.8, 0.8, 3.0], (15, 3))


def detect(states, noise, seed=0):
    return noisy_detection(points(), states, CAMERA, np.random.default_rng(seed), noise)


def test_without_noise_keypoints_are_projections():
    found = detect(VISIBLE, QUIET)
    assert np.allclose(found.keypoints_px, CAMERA.project(points()))
    assert (found.scores > 0).all()


def test_pixel_noise_has_the_stated_spread():
    noise = KeypointNoise((4.0, 4.0), 0.0, 0.0, 0.0, 0.0, 0.0)
    errors = [detect(VISIBLE, noise, k).keypoints_px - CAMERA.project(points())
              for k in range(200)]
    assert np.nanstd(errors) == pytest.approx(4.0, rel=0.05)


def test_hidden_joints_are_mostly_missing_and_guesses_score_low():
    states = VISIBLE.copy()
    states[5:] = JointState.SCENE_OCCLUDED
    found = [detect(states, KeypointNoise(), k) for k in range(200)]
    found = [detection for detection in found if detection is not None]
    rate = np.mean([detection.scores[5:] > 0 for detection in found])
    assert 0.1 < rate < 0.35
    guesses = np.concatenate([d.scores[5:][d.scores[5:] > 0] for d in found])
    seen = np.concatenate([d.scores[:5][d.scores[:5] > 0] for d in found])
    assert guesses.mean() < seen.mean() - 0.3


def test_joints_out_of_the_image_are_never_found():
    states = VISIBLE.copy()
    states[3] = JointState.OUT_OF_IMAGE
    far_out = points()
    far_out[3] = [5.0, 0.0, 2.0]
    for k in range(50):
        found = noisy_detection(
            far_out, states, CAMERA, np.random.default_rng(k), KeypointNoise(swaps=0.0))
        assert found.scores[3] == 0
        assert np.isnan(found.keypoints_px[3]).all()


def test_people_with_too_few_keypoints_are_not_found():
    states = np.full(15, int(JointState.SCENE_OCCLUDED))
    states[:3] = JointState.VISIBLE
    assert detect(states, QUIET) is None


def test_swapped_people_have_left_for_right():
    found = detect(VISIBLE, KeypointNoise((0.0, 0.0), 0.0, 0.0, 1.0, 0.0, 0.0))
    assert np.allclose(found.keypoints_px, CAMERA.project(points())[SHARED_MIRROR])
