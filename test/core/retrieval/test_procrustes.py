import numpy as np
import pytest

from pop_core.geometry.rotation import from_rotvec
from pop_core.retrieval.procrustes import (
    best_indices,
    rank_similarities,
    solve_similarities,
)

LIMITS = (0.5, 1.25)


def cloud(n: int, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(n, 15, 3)) * 0.35


def slow_twin(p: np.ndarray, q: np.ndarray, w: np.ndarray) -> float:
    """One pose at a time, by the textbook."""
    w = w / w.sum()
    p, q = p - w @ p, q - w @ q
    u, s, vt = np.linalg.svd((w[:, None] * q).T @ p)
    d = np.diag([1.0, 1.0, np.linalg.det(u @ vt)])
    scale = np.clip(np.trace(np.diag(s) @ d) / (w @ np.sum(p**2, axis=1)), *LIMITS)
    moved = scale * p @ (u @ d @ vt).T
    return float(np.sqrt(w @ np.sum((moved - q) ** 2, axis=1)))


@pytest.mark.parametrize('yaw_only', [False, True])
def test_a_known_similarity_is_recovered(yaw_only):
    rng = np.random.default_rng(1)
    points = cloud(5)
    R = from_rotvec(np.array([0.0, 2.1, 0.0]) if yaw_only else np.array([0.4, -2.0, 0.9]))
    for p in points:
        target = 0.8 * p @ R.T + [0.3, -0.2, 2.5]
        found = solve_similarities(
            p[None], target, rng.uniform(0.1, 1, 15), LIMITS, yaw_only=yaw_only)
        assert np.allclose(found.R[0], R, atol=1e-9)
        assert np.isclose(found.scale[0], 0.8)
        assert np.allclose(found.t[0], [0.3, -0.2, 2.5], atol=1e-9)
        assert np.allclose(found.apply(p[None])[0], target, atol=1e-9)
        assert found.residual_m[0] < 1e-6


def test_a_mirror_image_is_not_matched_by_a_reflection():
    p = cloud(1)
    found = solve_similarities(p, p[0] * [-1.0, 1.0, 1.0], np.ones(15), LIMITS)
    assert np.isclose(np.linalg.det(found.R[0]), 1.0)
    assert found.residual_m[0] > 0.1


def test_fast_costs_equal_the_slow_twin():
    rng = np.random.default_rng(2)
    points = cloud(400)
    target = points[0] + rng.normal(size=(15, 3)) * 0.2 + [0.0, 0.0, 3.0]
    weight = rng.uniform(0.2, 1.0, 15)
    expected = np.array([slow_twin(p, target, weight) for p in points])
    exact = solve_similarities(points, target, weight, LIMITS).residual_m
    fast = np.sqrt(_rank(points, target, weight))
    assert np.allclose(exact, expected, atol=1e-9)
    # Float32 sums and seven Newton steps: below a millimetre, far below any sensor.
    assert np.allclose(fast, expected, atol=1e-3)


def test_fast_and_slow_search_rank_poses_alike():
    rng = np.random.default_rng(3)
    base = cloud(1)
    points = base + rng.normal(size=(3000, 15, 3)) * rng.uniform(0.01, 0.3, (3000, 1, 1))
    weight = np.ones(15)
    target = base[0] @ from_rotvec(np.array([0.2, 1.0, -0.4])).T + [0.1, 0.2, 2.0]
    slow = np.array([slow_twin(p, target, weight) for p in points])
    fast = best_indices(_rank(points, target, weight), 50)
    assert np.array_equal(fast, np.argsort(slow, kind='stable')[:50])


def test_unmeasured_joints_do_not_count():
    points = cloud(50)
    weight = np.ones(15)
    weight[[3, 7]] = 0.0
    target = points[7] + [0.0, 0.0, 2.0]
    blind = target.copy()
    blind[[3, 7]] = np.nan
    assert np.array_equal(_rank(points, target, weight), _rank(points, blind, weight))
    assert best_indices(_rank(points, blind, weight), 1)[0] == 7


def test_yaw_search_refuses_to_lay_people_down():
    points = cloud(20)
    lying = points[4] @ from_rotvec(np.array([np.pi / 2, 0.0, 0.0])).T
    weight = np.ones(15)
    assert _rank(points, lying, weight)[4] < 1e-6
    assert _rank(points, lying, weight, yaw_only=True)[4] > 1e-2
    turned = points[4] @ from_rotvec(np.array([0.0, 1.2, 0.0])).T
    assert _rank(points, turned, weight, yaw_only=True)[4] < 1e-6


def test_the_price_of_leaning_is_what_both_solvers_say():
    points = cloud(300)
    target = points[3] @ from_rotvec(np.array([0.3, 0.8, -0.2])).T + [0.0, 0.0, 2.0]
    weight = np.ones(15)
    exact = solve_similarities(points, target, weight, LIMITS, upright=0.05)
    fast = _rank(points, target, weight, upright=0.05)
    assert np.allclose(np.sqrt(fast), np.sqrt(exact.residual_m**2 + exact.prior_cost), atol=1e-3)
    up = exact.R[:, :, 1] - [0.0, 1.0, 0.0]
    assert np.allclose(exact.prior_cost, 0.05 * exact.scale * np.sum(up**2, axis=1))


def test_the_price_of_size_is_what_both_solvers_say_and_pulls_toward_one():
    points = cloud(300)
    target = 0.6 * points[3] + [0.0, 0.0, 2.0]
    free = solve_similarities(points, target, np.ones(15), LIMITS)
    exact = solve_similarities(points, target, np.ones(15), LIMITS, sized=0.1)
    fast = _rank(points, target, np.ones(15), sized=0.1)
    assert np.allclose(np.sqrt(fast), np.sqrt(exact.residual_m**2 + exact.prior_cost), atol=1e-3)
    assert np.allclose(exact.prior_cost, 0.1 * (exact.scale - 1) ** 2)
    assert np.all(exact.scale >= free.scale)
    assert free.scale[3] < exact.scale[3] < 1.0


def test_a_high_price_of_leaning_equals_turns_about_y():
    points = cloud(5)
    target = points[1] @ from_rotvec(np.array([0.3, 0.8, -0.2])).T
    strict = solve_similarities(points, target, np.ones(15), LIMITS, yaw_only=True)
    dear = solve_similarities(points, target, np.ones(15), LIMITS, upright=1e4)
    assert np.allclose(strict.R, dear.R, atol=1e-3)
    assert np.allclose(strict.residual_m, dear.residual_m, atol=1e-3)


def test_scale_stays_human():
    points = cloud(3)
    for size, expected in ((0.2, 0.5), (3.0, 1.25)):
        found = solve_similarities(points, size * points[0], np.ones(15), LIMITS)
        assert np.isclose(found.scale[0], expected)


def test_one_thread_and_several_agree():
    points = np.random.default_rng(4).normal(size=(25_000, 15, 3)) * 0.3
    target, weight = points[11] + [0, 0, 2.0], np.ones(15)
    columns = np.ascontiguousarray(points.astype(np.float32).transpose(1, 2, 0))
    one, three = (
        rank_similarities(columns, target, weight, LIMITS, threads=n) for n in (1, 3))
    assert np.array_equal(one, three)


def _rank(points: np.ndarray, target: np.ndarray, weight: np.ndarray, **options) -> np.ndarray:
    columns = np.ascontiguousarray(points.astype(np.float32).transpose(1, 2, 0))
    return rank_similarities(columns, target, weight, LIMITS, **options)
