import numpy as np
import pytest

from pop_core.body.joint_limits import TWIST_AXES, mirrored_pose, pose_coordinates
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.geometry.swing_twist import from_swing_twist
from pop_core.retrieval.pose_prior import PosePrior, load_pose_prior


def test_the_cost_is_the_log_density_of_the_likeliest_component_but_for_a_constant():
    prior = load_pose_prior()
    poses = prior.sample(np.random.default_rng(0), 40)
    energy = np.array([prior.cost(c) for c in pose_coordinates(poses)])
    cost = prior.component_costs(pose_coordinates(poses).reshape(40, -1)).min(axis=1)
    assert np.allclose(energy - cost, (energy - cost)[0], atol=1e-6)


def test_component_density_is_that_of_its_covariance():
    prior = load_pose_prior()
    c = pose_coordinates(prior.sample(np.random.default_rng(1), 1)).reshape(-1)
    k = 1
    covariance = prior.factors[k] @ prior.factors[k].T + np.diag(prior.variances[k])
    offset = c - prior.means[k]
    _, log_det = np.linalg.slogdet(2 * np.pi * covariance)
    expected = 0.5 * (offset @ np.linalg.solve(covariance, offset) + log_det)
    found = prior.component_costs(c[None])[0, k] + np.log(prior.weights[k])
    assert np.isclose(found, expected)


def test_gradient_agrees_with_central_differences():
    prior = load_pose_prior()
    for pose in prior.sample(np.random.default_rng(2), 3):
        cost, gradient, _ = prior.quadratic(pose_coordinates(pose))
        assert np.isclose(cost, cost_of(prior, pose))
        for column in range(0, 69, 5):
            delta = np.zeros(69)
            delta[column] = 1e-6
            ahead, behind = (cost_of(prior, turned(pose, sign * delta)) for sign in (1, -1))
            assert np.isclose(gradient[column], (ahead - behind) / 2e-6, atol=1e-3)


def test_the_hessian_bends_the_cost_at_the_middle_of_a_component():
    prior = load_pose_prior()
    middle = from_swing_twist(prior.means[0].reshape(23, 3), TWIST_AXES)
    cost, gradient, hessian = prior.quadratic(pose_coordinates(middle))
    assert np.allclose(gradient, 0.0, atol=1e-6)
    for seed in range(5):
        delta = 1e-4 * np.random.default_rng(seed).normal(size=69)
        ahead, behind = (cost_of(prior, turned(middle, sign * delta)) for sign in (1, -1))
        around = (ahead + behind) / 2
        assert np.isclose(around - cost, 0.5 * delta @ hessian @ delta, rtol=1e-3)


def cost_of(prior: PosePrior, pose: np.ndarray) -> float:
    return prior.cost(pose_coordinates(pose))


def turned(pose: np.ndarray, delta: np.ndarray) -> np.ndarray:
    return to_rotvec(from_rotvec(delta.reshape(23, 3)) @ from_rotvec(pose))


def test_samples_have_the_moments_of_their_component():
    prior = load_pose_prior()
    c = pose_coordinates(prior.sample_components(
        np.random.default_rng(3), np.zeros(20000, dtype=np.int64))).reshape(20000, -1)
    sigma = np.sqrt(np.sum(prior.factors[0] ** 2, axis=1) + prior.variances[0])
    reach = np.abs(prior.means[0]) + 4.5 * sigma
    unwrapped = np.repeat((np.linalg.norm(reach.reshape(23, 3), axis=1) < np.pi), 3)
    assert unwrapped.sum() > 40
    # 4.5 standard errors of a mean: one false alarm in a thousand runs of 69 coordinates.
    error = np.abs(c.mean(axis=0) - prior.means[0])
    assert np.all((error < 4.5 * sigma / np.sqrt(20000))[unwrapped])


def test_sampling_is_decided_by_its_seed():
    prior = load_pose_prior()
    first, second = (prior.sample(np.random.default_rng(4), 5) for _ in range(2))
    assert np.array_equal(first, second)


def test_knees_that_bend_forward_are_less_likely_than_knees_that_bend_back():
    prior = load_pose_prior()
    forward = prior.sample(np.random.default_rng(5), 50)
    back = forward.copy()
    forward[:, 3, 0], back[:, 3, 0] = -1.0, 1.0
    gain = prior.log_density(back) - prior.log_density(forward)
    assert np.mean(gain > 0) > 0.9
    assert np.median(gain) > 15


def test_poses_and_their_mirror_images_are_alike_likely():
    prior = load_pose_prior()
    poses = prior.sample(np.random.default_rng(6), 200)
    gap = prior.log_density(poses) - prior.log_density(mirrored_pose(poses))
    # Learned from mirrored data; components are not tied to mirror twins, so only on average.
    assert abs(np.mean(gap)) < 3.0


def test_a_file_that_is_no_prior_is_named(tmp_path):
    path = tmp_path / 'prior.npz'
    np.savez(path, weights=np.ones(1))
    with pytest.raises(LibraryFileError, match=r'prior\.npz: expected an npz with weights'):
        load_pose_prior(path)


def test_wrong_shapes_are_refused():
    with pytest.raises(LibraryFileError, match='69 coordinates'):
        PosePrior(np.ones(1), np.zeros((1, 68)), np.zeros((1, 68, 2)), np.ones((1, 68)),
                  np.ones(1, dtype=bool))


def test_the_motion_part_is_a_mixture_of_its_own():
    prior = load_pose_prior()
    part = prior.motion_part()
    assert 0 < len(part.weights) < len(prior.weights)
    assert np.isclose(part.weights.sum(), 1.0)
