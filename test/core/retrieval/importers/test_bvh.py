from pathlib import Path

import numpy as np
import pytest

from benchmarks.pose_files import write_bvh
from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX, PARENTS, SHARED_INDEX
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.importers.bvh import read_bvh
from pop_core.retrieval.importers.bvh_file import read_bvh_motion
from pop_core.retrieval.importers.clip import upright_tilt
from pop_core.retrieval.pose_library import pose_columns
from pop_core.retrieval.procedural.families import FAMILIES, draw_batch

REST = default_body().joint_template


def some_poses(n: int = 20) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    poses = draw_batch(FAMILIES['walking'], default_body(), rng, 4 * n)
    heading = np.zeros((n, 3))
    heading[:, 1] = rng.uniform(-3, 3, n)
    root = to_rotvec(from_rotvec(heading) @ from_rotvec(poses.tilt[:n]))
    return root, poses.body_pose[:n]


def joints(body_pose: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    columns = pose_columns(body_pose.astype(float), tilt.astype(float), default_body())
    return columns.transpose(2, 0, 1)


@pytest.mark.parametrize('style', ['motionbuilder', 'daz'])
def test_poses_return_from_a_file(tmp_path, style):
    root, body = some_poses()
    path = tmp_path / 'walk.bvh'
    write_bvh(path, root, body, REST, style)
    clip = read_bvh(path, default_body())
    expected = joints(body, upright_tilt(root, 'y'))
    found = joints(clip.body_pose, clip.tilt)
    # The spine bends evenly afterwards, which moves shoulders by millimetres.
    assert np.linalg.norm(found - expected, axis=2).max() < 0.03


def test_a_rest_pose_with_arms_down_and_legs_astride_is_made_up_for(tmp_path):
    root, body = some_poses()
    turn = {'left_shoulder': [0, 0, -1.2], 'right_shoulder': [0, 0, 1.2],
            'left_hip': [0, 0, 0.35], 'right_hip': [0, 0, -0.35]}
    other, R_rest = astride(turn)
    path = tmp_path / 'other.bvh'
    local = from_rotvec(np.concatenate([root[:, None], body], axis=1))
    redone = local.copy()
    for j, parent in enumerate(PARENTS):
        above = R_rest[parent] if parent >= 0 else np.eye(3)
        redone[:, j] = above @ local[:, j] @ R_rest[j].T
    rotvec = to_rotvec(redone)
    write_bvh(path, rotvec[:, 0], rotvec[:, 1:], other)
    clip = read_bvh(path, default_body())
    expected = joints(body, upright_tilt(root, 'y'))
    limbs = [row for name, row in SHARED_INDEX.items() if name not in ('head', 'neck')]
    gap = np.linalg.norm(joints(clip.body_pose, clip.tilt) - expected, axis=2)[:, limbs]
    assert gap.max() < 0.03


def astride(turn: dict[str, list[float]]) -> tuple[np.ndarray, np.ndarray]:
    """Return a rest pose with some joints turned, and the turn of each joint's bones."""
    R = np.tile(np.eye(3), (24, 1, 1))
    rest = REST.copy()
    for j, parent in enumerate(PARENTS):
        if parent >= 0:
            R[j] = R[parent]
            rest[j] = rest[parent] + R[parent] @ (REST[j] - REST[parent])
        for name, rotvec in turn.items():
            if JOINT_INDEX[name] == j:
                R[j] = from_rotvec(np.array(rotvec, dtype=float)) @ R[j]
    return rest, R


def test_a_skeleton_that_faces_backwards_is_turned(tmp_path):
    root, body = some_poses()
    back = from_rotvec(np.array([0.0, np.pi, 0.0]))
    path = tmp_path / 'back.bvh'
    local = back @ from_rotvec(np.concatenate([root[:, None], body], axis=1)) @ back.T
    rotvec = to_rotvec(local)
    write_bvh(path, rotvec[:, 0], rotvec[:, 1:], REST @ back.T)
    clip = read_bvh(path, default_body())
    expected = joints(body, upright_tilt(root, 'y'))
    assert np.linalg.norm(joints(clip.body_pose, clip.tilt) - expected, axis=2).max() < 0.03


def test_every_nth_frame_is_read(tmp_path):
    root, body = some_poses(10)
    path = tmp_path / 'walk.bvh'
    write_bvh(path, root, body, REST)
    assert len(read_bvh(path, default_body(), every=4)) == 3


def test_the_tree_is_that_of_the_file(tmp_path):
    root, body = some_poses(2)
    path = tmp_path / 'walk.bvh'
    write_bvh(path, root, body, REST)
    motion = read_bvh_motion(path)
    knee = motion.names.index('LeftLeg')
    assert motion.names[motion.parents[knee]] == 'LeftUpLeg'
    expected = 100 * (REST[JOINT_INDEX['left_knee']] - REST[JOINT_INDEX['left_hip']])
    assert np.allclose(motion.offsets[knee], expected, atol=1e-4)


@pytest.mark.parametrize(('damage', 'match'), [
    (lambda text: text[:300], 'HIERARCHY and MOTION'),
    (lambda text: text[: text.index('MOTION') - 40] + text[text.index('MOTION'):], 'hierarchy'),
    (lambda text: text[:-200], 'numbers'),
    (lambda text: text.replace('Frames: 3', 'Frames: x'), 'rows of numbers'),
    (lambda text: text.replace('LeftUpLeg', 'Tentacle'), 'joints named as'),
    (lambda text: text + ' 1.0', 'numbers'),
    (lambda text: text[: text.index('Frame Time')] + 'x', 'Frame Time'),
    (lambda _: '', 'HIERARCHY'),
])
def test_damaged_files_are_refused_in_one_line(tmp_path: Path, damage, match):
    root, body = some_poses(3)
    path = tmp_path / 'bad.bvh'
    write_bvh(path, root, body, REST)
    path.write_text(damage(path.read_text()))
    with pytest.raises(LibraryFileError, match=match) as caught:
        read_bvh(path, default_body())
    assert '\n' not in str(caught.value)


def test_not_a_number_is_refused_by_frame(tmp_path):
    root, body = some_poses(3)
    path = tmp_path / 'nan.bvh'
    write_bvh(path, root, body, REST)
    lines = path.read_text().splitlines()
    lines[-2] = ' '.join(['nan'] * len(lines[-2].split()))
    path.write_text('\n'.join(lines))
    with pytest.raises(LibraryFileError, match='frame 1'):
        read_bvh(path, default_body())
