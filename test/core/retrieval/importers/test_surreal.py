from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from benchmarks.pose_files import write_surreal
from pop_core.body.default_body import default_body
from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyParameters
from pop_core.body.skinning import vertices
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec
from pop_core.rendering.depth_renderer import render_depth
from pop_core.retrieval.importers.clip import upright_tilt
from pop_core.retrieval.importers.surreal import CAMERA, read_surreal
from pop_core.retrieval.pose_library import ALL_VISIBLE

FRAMES = 3


def poses() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    root = np.zeros((FRAMES, 3))
    root[:, 1] = rng.uniform(-0.3, 0.3, FRAMES)
    body = rng.normal(size=(FRAMES, 23, 3)) * 0.05
    body[:, 15, 2], body[:, 16, 2] = -1.1, 1.1  # arms down
    return root, body


def clip(folder: Path, wall_left_of_px: int | None = None, images: bool = True) -> Path:
    """A clip of a standing person, its left half behind a wall when asked for."""
    root, body = poses()
    model = default_body()
    pixels, depths, people = np.zeros((FRAMES, 24, 2)), {}, {}
    for i in range(FRAMES):
        R = from_rotvec(np.array([np.pi, 0.0, 0.0])) @ from_rotvec(root[i])
        view = BodyParameters(
            np.array([0.0, 0.2, 6.0]), rotvec_of(R), body[i], np.zeros(model.n_betas))
        rendered = render_depth(vertices(model, view), model.f, CAMERA)
        z = np.where(rendered.covered, rendered.depth_m, 1e10)
        person = rendered.covered.astype(np.uint8)
        if wall_left_of_px is not None:
            z[:, wall_left_of_px:], person[:, wall_left_of_px:] = 4.0, 0
        depths[f'depth_{i + 1}'], people[f'segm_{i + 1}'] = z.astype(np.float32), person
        pixels[i] = CAMERA.project(joints(model, view))
    path = write_surreal(folder, 'run1_c0001', root, body, pixels)
    if images:
        savemat(folder / 'run1_c0001_depth.mat', depths)
        savemat(folder / 'run1_c0001_segm.mat', people)
    return path


def rotvec_of(R: np.ndarray) -> np.ndarray:
    from pop_core.geometry.rotation import to_rotvec

    return to_rotvec(R)


def test_poses_are_those_of_the_file(tmp_path):
    root, body = poses()
    found = read_surreal(clip(tmp_path, images=False))
    assert np.allclose(found.body_pose, body, atol=1e-6)
    assert np.allclose(found.tilt, upright_tilt(root, 'y'), atol=1e-6)
    assert (found.masks == ALL_VISIBLE).all()


def test_a_person_in_the_open_is_visible(tmp_path):
    masks = read_surreal(clip(tmp_path)).masks
    for name in ('neck', 'left_knee', 'right_knee', 'left_ankle', 'left_elbow', 'right_wrist'):
        assert (masks >> SHARED_INDEX[name] & 1).all(), name


def test_what_a_wall_hides_is_not_visible(tmp_path):
    masks = read_surreal(clip(tmp_path, wall_left_of_px=160)).masks
    # The person faces the camera: their left is on the right of the image.
    for name in ('left_shoulder', 'left_knee', 'left_ankle', 'left_wrist'):
        assert not (masks >> SHARED_INDEX[name] & 1).any(), name
    for name in ('right_knee', 'right_ankle', 'right_wrist'):
        assert (masks >> SHARED_INDEX[name] & 1).all(), name


def test_one_frame_is_a_clip_too(tmp_path):
    root, body = poses()
    path = write_surreal(tmp_path, 'one', root[:1], body[:1], np.zeros((1, 24, 2)))
    assert len(read_surreal(path)) == 1


def test_damaged_files_are_refused(tmp_path):
    path = clip(tmp_path, images=False)
    whole = path.read_bytes()
    path.write_bytes(whole[:400])
    with pytest.raises(LibraryFileError, match='MATLAB'):
        read_surreal(path)
    path.write_bytes(b'')
    with pytest.raises(LibraryFileError, match='MATLAB'):
        read_surreal(path)
    savemat(path, {'shape': np.zeros((10, 2))})
    with pytest.raises(LibraryFileError, match='variable pose'):
        read_surreal(path)
    savemat(path, {'pose': np.zeros((70, 3)), 'joints2D': np.zeros((2, 24, 3))})
    with pytest.raises(LibraryFileError, match='pose: expected 72'):
        read_surreal(path)


def test_depth_of_another_size_is_refused(tmp_path):
    path = clip(tmp_path)
    savemat(tmp_path / 'run1_c0001_depth.mat', {'depth_1': np.zeros((10, 10))})
    with pytest.raises(LibraryFileError, match='depth_1 of 240x320'):
        read_surreal(path)
