import pickle
from pathlib import Path

import numpy as np
import pytest

from pop_core.errors import LibraryFileError
from pop_core.retrieval.importers.clip import upright_tilt
from pop_core.retrieval.importers.smpl_npz import read_smpl_npz


def amass(path: Path, width: int = 156, n: int = 9) -> np.ndarray:
    """A file of exactly the layout AMASS publishes."""
    poses = np.random.default_rng(0).normal(size=(n, width)) * 0.3
    np.savez(
        path, poses=poses, trans=np.zeros((n, 3)), betas=np.zeros(16), dmpls=np.zeros((n, 8)),
        gender=np.array('female'), mocap_framerate=np.array(120.0))
    return poses


@pytest.mark.parametrize('width', [156, 165])
def test_amass_bodies_are_read_and_fingers_left(tmp_path, width):
    path = tmp_path / 'walk_poses.npz'
    poses = amass(path, width)
    clip = read_smpl_npz(path)
    assert np.allclose(clip.body_pose[:, :21], poses[:, 3:66].reshape(-1, 21, 3), atol=1e-6)
    assert not clip.body_pose[:, 21:].any()
    assert np.allclose(clip.tilt, upright_tilt(poses[:, :3], 'z'), atol=1e-6)


@pytest.mark.parametrize('shape', [(5, 72), (5, 24, 3)])
def test_plain_smpl_is_read_with_y_up(tmp_path, shape):
    poses = np.random.default_rng(1).normal(size=shape) * 0.3
    path = tmp_path / 'mine.npz'
    np.savez(path, pose=poses)
    flat = poses.reshape(5, 72)
    clip = read_smpl_npz(path)
    assert np.allclose(clip.body_pose, flat[:, 3:].reshape(5, 23, 3), atol=1e-6)
    assert np.allclose(clip.tilt, upright_tilt(flat[:, :3], 'y'), atol=1e-6)


def test_bodies_with_a_root_of_their_own_are_joined(tmp_path):
    rng = np.random.default_rng(2)
    root, body = rng.normal(size=(4, 3)) * 0.2, rng.normal(size=(4, 63)) * 0.2
    path = tmp_path / 'stage.npz'
    np.savez(path, root_orient=root, pose_body=body, mocap_frame_rate=np.array(30))
    clip = read_smpl_npz(path)
    assert np.allclose(clip.body_pose[:, :21].reshape(4, 63), body, atol=1e-6)
    assert np.allclose(clip.tilt, upright_tilt(root, 'z'), atol=1e-6)


def refused(path: Path, match: str) -> None:
    with pytest.raises(LibraryFileError, match=match) as caught:
        read_smpl_npz(path)
    assert '\n' not in str(caught.value)


def test_a_cut_file_is_refused_in_one_line(tmp_path):
    path = tmp_path / 'cut.npz'
    amass(path)
    path.write_bytes(path.read_bytes()[:700])
    refused(path, 'expected an npz')


def test_a_foreign_pickle_is_refused_and_not_run(tmp_path):
    witness = tmp_path / 'ran'

    class Foreign:
        def __reduce__(self):
            return Path.touch, (witness,)

    path = tmp_path / 'foreign.npz'
    np.savez(path, poses=np.array([Foreign()], dtype=object))
    refused(path, 'expected an npz of plain arrays')
    raw = tmp_path / 'raw.npz'
    raw.write_bytes(pickle.dumps(Foreign()))
    refused(raw, 'expected an npz of plain arrays')
    assert not witness.exists()


def test_another_width_is_refused(tmp_path):
    path = tmp_path / 'odd.npz'
    np.savez(path, poses=np.zeros((3, 70)))
    refused(path, 'numbers per pose, found 70')


def test_a_file_without_poses_is_refused(tmp_path):
    path = tmp_path / 'betas.npz'
    np.savez(path, betas=np.zeros(10))
    refused(path, 'expected one of')


def test_a_root_of_another_length_is_refused(tmp_path):
    path = tmp_path / 'roots.npz'
    np.savez(path, pose_body=np.zeros((4, 63)), root_orient=np.zeros((3, 3)))
    refused(path, 'expected 4 root rotations')
