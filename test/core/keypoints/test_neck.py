import numpy as np
import pytest
from keypoint_bodies import CAMERA, show

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.neck import with_detector_neck, with_smpl_neck

NECK, PELVIS, NOSE = (SHARED_INDEX[name] for name in ('neck', 'pelvis', 'head'))
SHOULDERS = [SHARED_INDEX['left_shoulder'], SHARED_INDEX['right_shoulder']]


@pytest.mark.parametrize('missing', [[], [PELVIS], [PELVIS, NOSE], [NOSE], [NECK]])
def test_the_two_conventions_undo_each_other(missing):
    uv = np.random.default_rng(0).uniform(0, 600, (15, 2))
    uv[NECK] = uv[SHOULDERS].mean(axis=0)
    uv[missing] = np.nan
    np.testing.assert_allclose(with_detector_neck(with_smpl_neck(uv)), uv, atol=1e-9)


def test_only_the_neck_moves():
    uv = np.random.default_rng(1).uniform(0, 600, (15, 2))
    others = np.arange(15) != NECK
    assert np.array_equal(with_smpl_neck(uv)[others], uv[others])


@pytest.mark.parametrize('yaw', [0.0, 0.6, 1.5, np.pi])
@pytest.mark.parametrize('pelvis_seen', [True, False])
def test_the_middle_of_the_shoulders_becomes_the_neck_of_the_body(yaw, pelvis_seen):
    body = show(yaw=yaw)
    uv = CAMERA.project(body.truth)
    uv[NECK] = uv[SHOULDERS].mean(axis=0)
    if not pelvis_seen:
        uv[PELVIS] = np.nan
    truth = CAMERA.project(body.truth)[NECK]
    before, after = (np.linalg.norm(p[NECK] - truth) for p in (uv, with_smpl_neck(uv)))
    metres = 2.6 / CAMERA.fx
    assert before * metres > 0.09
    # From the side the nose lies before the neck, too.
    assert after * metres < (0.03 if pelvis_seen else 0.08)


def test_a_neck_that_is_already_the_bodys_stays():
    uv = CAMERA.project(show(yaw=0.4).truth)
    np.testing.assert_array_equal(with_smpl_neck(uv), uv)
