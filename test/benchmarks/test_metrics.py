import numpy as np
import pytest

from benchmarks import metrics
from pop_core.body.default_body import default_body
from pop_core.body.model import rest_parameters
from pop_core.body.skinning import vertices
from pop_core.geometry.rotation import from_rotvec
from pop_core.rendering.depth_renderer import RenderedDepth


@pytest.fixture(scope='module')
def model():
    return default_body()


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def with_shape(rng, scale=1.0):
    return rest_parameters().replaced(betas=rng.normal(size=10), scale=scale)


def test_the_mean_body_has_shape_error_one(model, rng):
    assert metrics.shape_error(model, rest_parameters(), with_shape(rng)) == pytest.approx(1.0)


def test_the_true_shape_has_no_shape_error_whatever_its_scale(model, rng):
    truth = with_shape(rng, scale=0.8)
    assert metrics.shape_error(model, truth, truth) == 0.0


def test_folding_recovers_betas_that_already_say_the_scale(model, rng):
    # v_template + S beta, scaled about its centre, is again of the shape space only as nearly as
    # the space holds that scaling: the folded body must be nearer than the body left unscaled.
    scaled = with_shape(rng, scale=1.05)
    folded = rest_parameters().replaced(betas=metrics.folded_betas(model, scaled))
    unscaled = scaled.replaced(scale=1.0)
    assert metrics.tpose_error(model, folded, scaled) < metrics.tpose_error(
        model, unscaled, scaled)


def test_folding_leaves_bodies_of_scale_one_alone(model, rng):
    body = with_shape(rng)
    assert np.array_equal(metrics.folded_betas(model, body), body.betas)


def test_eq_4_takes_23_joints_and_eq_5_takes_14_of_them():
    assert metrics.smpl_joints().sum() == 23
    assert metrics.pose_joints().sum() == 14
    assert not metrics.pose_joints()[0]
    assert (metrics.smpl_joints() | ~metrics.pose_joints()).all()


def test_a_shift_is_the_absolute_error_and_vanishes_after_root_alignment(rng):
    truth = rng.normal(size=(24, 3))
    shift = np.array([0.03, 0.0, 0.04])
    errors = metrics.joint_errors(truth + shift, truth)
    assert metrics.mean_over(errors, metrics.smpl_joints()) == pytest.approx(0.05)
    assert metrics.root_aligned_error(truth + shift, truth) == pytest.approx(0.0, abs=1e-12)


def test_no_similarity_changes_the_procrustes_aligned_error(rng):
    truth = rng.normal(size=(24, 3))
    estimate = truth + rng.normal(0, 0.05, (24, 3))
    moved = 1.7 * estimate @ from_rotvec(np.array([0.3, -1.0, 0.5])).T + [1.0, 2.0, 3.0]
    before = metrics.procrustes_aligned_error(estimate, truth)
    assert before > 0.01
    assert metrics.procrustes_aligned_error(moved, truth) == pytest.approx(before)


def test_a_mirror_image_keeps_its_procrustes_aligned_error(rng):
    truth = rng.normal(size=(24, 3))
    assert metrics.procrustes_aligned_error(truth * [-1.0, 1.0, 1.0], truth) > 0.1


def test_the_mean_over_no_joints_is_not_a_number():
    assert np.isnan(metrics.mean_over(np.ones(24), np.zeros(24, dtype=bool)))


def test_share_within_counts_errors_below_the_limit():
    assert metrics.share_within(np.array([0.05, 0.09, 0.11, 0.3]), 0.1) == 0.5


def test_stature_grows_with_scale(model):
    mean = rest_parameters()
    assert 1.5 < metrics.stature(model, mean) < 1.9
    taller = metrics.stature(model, mean.replaced(scale=1.1))
    assert taller == pytest.approx(1.1 * metrics.stature(model, mean))


def test_tpose_error_ignores_pose_and_place(model, rng):
    body = with_shape(rng)
    posed = body.replaced(transl=np.ones(3), body_pose=rng.normal(0, 0.3, (23, 3)))
    assert metrics.tpose_error(model, posed, body) == 0.0


def test_distance_to_a_triangle_agrees_with_dense_sampling(rng):
    a, b, c = rng.normal(size=(3, 40, 3))
    p = rng.normal(size=(40, 3)) * 2
    u, v = rng.random((2, 20_000))
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    for k in range(40):
        sampled = a[k] + u[:, None] * (b[k] - a[k]) + v[:, None] * (c[k] - a[k])
        slow = np.linalg.norm(sampled - p[k], axis=1).min()
        row = slice(k, k + 1)
        fast = metrics.distance_to_triangles(p[row], a[row], b[row], c[row])[0]
        assert fast <= slow + 1e-12
        assert fast == pytest.approx(slow, abs=0.06)  # samples lie about 2 cm apart


def test_few_candidate_triangles_find_the_distance_that_all_triangles_give(model, rng):
    mesh = vertices(model, rest_parameters())
    points = mesh[rng.integers(0, len(mesh), 20)] + rng.normal(0, 0.03, (20, 3))
    few = metrics.distance_to_surface(points, mesh, model.f)
    every = metrics.distance_to_surface(points, mesh, model.f, candidates=len(model.f))
    assert np.abs(few - every).max() < 5e-4


def test_points_of_a_mesh_are_nearer_to_its_surface_than_to_its_vertices(model):
    mesh = vertices(model, rest_parameters())
    middles = mesh[model.f].mean(axis=1)[::50]
    assert metrics.distance_to_surface(middles, mesh, model.f).max() < 1e-9
    assert metrics.distance_to_vertices(middles, mesh).mean() > 0.002


def test_free_space_violation_is_the_share_of_pixels_before_the_measured_depth():
    rendered = RenderedDepth(
        np.array([[1.0, 1.0], [1.0, np.inf]], np.float32), np.array([[0, 0], [0, -1]], np.int32))
    measured = np.array([[1.2, 1.02], [np.nan, 2.0]], np.float32)
    assert metrics.free_space_violation(rendered, measured) == 0.5


def test_mask_scores_of_a_half_found_person():
    truth = np.zeros((4, 4), dtype=bool)
    truth[:2] = True
    found = np.zeros((4, 4), dtype=bool)
    found[1:3] = True
    assert metrics.mask_scores(found, truth) == pytest.approx((1 / 3, 0.5, 0.5))


def test_stated_ellipsoids_hold_the_share_they_claim(rng):
    A = rng.normal(size=(3, 3))
    covariance = A @ A.T
    n = 40_000
    errors = rng.multivariate_normal(np.zeros(3), covariance, n)
    squared = metrics.mahalanobis2(errors, np.zeros((n, 3)), np.tile(covariance, (n, 1, 1)))
    assert (squared < metrics.CHI2_3_68).mean() == pytest.approx(0.68, abs=0.01)
    assert (squared < metrics.CHI2_3_95).mean() == pytest.approx(0.95, abs=0.01)
