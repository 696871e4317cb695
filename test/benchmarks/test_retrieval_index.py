import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.approximate_indices import Index
from benchmarks.retrieval_index import Poses, canonical, completed, exact_best, indexed_best
from pop_core.body.default_body import default_body
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.retrieval.pose_library import pose_columns


@pytest.fixture(scope='module')
def columns():
    rng = np.random.default_rng(4)
    pose = rng.normal(0, 0.3, (400, 23, 3))
    return pose_columns(pose, np.zeros((400, 3)), default_body())


@pytest.fixture(scope='module')
def poses(columns):
    rows = np.ascontiguousarray(columns.transpose(2, 0, 1))
    return Poses(columns, rows, np.ascontiguousarray(columns[:, :, ::4]))


def moved(joints, rng):
    R = Rotation.random(len(joints), random_state=rng).as_matrix()
    scale = rng.uniform(0.5, 2.0, (len(joints), 1, 1))
    return scale * np.einsum('nrc,nkc->nkr', R, joints) + rng.normal(0, 3, (len(joints), 1, 3))


def seen(joints, hidden=()):
    joints = np.array(joints, dtype=np.float64)
    sigma = np.full(15, 0.02)
    joints[list(hidden)], sigma[list(hidden)] = np.nan, np.inf
    return LiftedJoints(
        joints, sigma, np.zeros(15, dtype=int), np.full((15, 2), np.nan), np.ones(15))


def nearest(vectors):
    def search(asked, n):
        return np.argsort(np.linalg.norm(vectors - asked[:, None], axis=2), axis=1)[:, :n]

    return Index('slow', search, 0.0, 0.0)


def test_no_similarity_transform_changes_a_canonical_pose(poses):
    joints = poses.rows.astype(np.float64)
    there = canonical(moved(joints, np.random.default_rng(1)))
    np.testing.assert_allclose(there, canonical(joints), atol=1e-5)  # single precision


def test_a_mirror_image_and_another_pose_are_canonically_different(poses):
    vectors = canonical(poses.rows)
    mirrored = canonical(poses.rows * np.float32([-1, 1, 1]))
    assert np.linalg.norm(vectors - mirrored, axis=1).min() > 0.1
    assert np.linalg.norm(vectors - np.roll(vectors, 1, axis=0), axis=1).min() > 0.1


def test_a_complete_skeleton_is_not_completed(poses):
    query = seen(poses.rows[7])
    assert np.array_equal(completed(poses.prototypes, query)[0], query.positions_camera)


def test_hidden_joints_are_lent_in_the_camera_and_the_seen_ones_kept(poses):
    R = Rotation.random(random_state=2).as_matrix()
    whole = poses.prototypes[:, :, 5] @ R.T + [0.2, -0.1, 3.0]
    out = completed(poses.prototypes, seen(whole, hidden=(5, 6, 13)))
    np.testing.assert_allclose(out[0], whole, atol=1e-4)
    assert np.array_equal(out[:, :5], np.broadcast_to(whole[:5], (len(out), 5, 3)))


def test_an_index_that_lists_every_pose_finds_the_exact_best(poses):
    query = seen(poses.rows[20] + np.float32(0.01), hidden=(11, 13))
    whole = indexed_best(poses, nearest(canonical(poses.rows)), 8 * len(poses.rows), query)
    assert np.array_equal(np.sort(whole), np.sort(exact_best(poses.columns, query)))
