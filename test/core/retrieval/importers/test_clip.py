import numpy as np
import pytest

from pop_core.body.joints import SHARED_INDEX
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.importers.clip import make_clip, upright_tilt


def poses(n: int = 6) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return rng.normal(size=(n, 3)) * 0.3, rng.normal(size=(n, 23, 3)) * 0.3


def test_tilt_does_not_know_the_heading():
    root, _ = poses()
    turned = to_rotvec(from_rotvec(np.array([0.0, 1.9, 0.0])) @ from_rotvec(root))
    assert np.allclose(upright_tilt(turned, 'y'), upright_tilt(root, 'y'), atol=1e-9)


def test_tilt_of_a_world_with_z_up_is_that_of_y_up():
    root, _ = poses()
    stood = to_rotvec(from_rotvec(np.array([np.pi / 2, 0.0, 0.0])) @ from_rotvec(root))
    assert np.allclose(upright_tilt(stood, 'z'), upright_tilt(root, 'y'), atol=1e-9)


def test_upright_people_have_no_tilt():
    assert np.allclose(upright_tilt(np.array([[0.0, 2.5, 0.0]]), 'y'), 0, atol=1e-9)


def test_people_on_their_back_point_their_feet_ahead():
    root = np.array([[-np.pi / 2, 0.0, 0.0]])
    feet = from_rotvec(upright_tilt(root, 'y'))[0] @ [0.0, -1.0, 0.0]
    assert np.allclose(feet, [0.0, 0.0, 1.0], atol=1e-9)


def test_a_mirror_swaps_sides_of_poses_and_visibility():
    root, body = poses(2)
    mask = np.array([1 << SHARED_INDEX['left_wrist'], 1 << SHARED_INDEX['neck']], dtype=np.uint16)
    clip = make_clip(root, body, 'y', mask).with_mirror()
    assert len(clip) == 4
    assert clip.masks[2:].tolist() == [1 << SHARED_INDEX['right_wrist'], 1 << SHARED_INDEX['neck']]
    left_knee, right_knee = 3, 4
    assert np.allclose(
        clip.body_pose[2:, right_knee], body[:, left_knee] * [1, -1, -1], atol=1e-6)


@pytest.mark.parametrize('bad', [np.nan, np.inf, 1e3])
def test_numbers_that_are_no_angles_are_refused_by_frame(bad):
    root, body = poses()
    body[4, 7, 1] = bad
    with pytest.raises(LibraryFileError, match='frame 4: expected finite pose rotations'):
        make_clip(root, body, 'y')


def test_no_pose_is_refused():
    with pytest.raises(LibraryFileError, match='at least one pose'):
        make_clip(np.zeros((0, 3)), np.zeros((0, 23, 3)), 'y')
