import numpy as np
import pytest

from pop_core.fitting.levenberg_marquardt import (
    FIRST_DAMPING,
    NormalEquations,
    Quadratic,
    Residual,
    assemble,
    cost_of,
    damped_step,
    levenberg_marquardt_step,
    with_lower,
)

EVERYTHING = np.ones(2, dtype=bool)


def rosenbrock(x: np.ndarray, jacobian: bool) -> list[Residual]:
    r = np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]])
    J = np.array([[-20 * x[0], 10.0], [-1.0, 0.0]]) if jacobian else None
    return [Residual(r, J, np.ones(2))]


def minimise(x: np.ndarray, active: np.ndarray, steps: int = 60) -> np.ndarray:
    damping = FIRST_DAMPING
    for _ in range(steps):
        report = levenberg_marquardt_step(x, rosenbrock, np.add, active, damping)
        assert report.cost_after <= report.cost_before
        x, damping = report.state, report.damping
    return x


def test_the_valley_of_rosenbrock_is_followed_to_its_end() -> None:
    np.testing.assert_allclose(minimise(np.array([-1.2, 1.0]), EVERYTHING), [1, 1], atol=1e-6)


def test_inactive_parameters_do_not_move() -> None:
    x = minimise(np.array([-1.2, 1.0]), np.array([True, False]))
    assert x[1] == 1.0
    assert abs(x[0]) > 0.9


def test_a_minimum_is_left_alone() -> None:
    report = levenberg_marquardt_step(np.ones(2), rosenbrock, np.add, EVERYTHING, FIRST_DAMPING)
    np.testing.assert_array_equal(report.state, np.ones(2))
    assert not report.accepted


def test_nothing_moves_where_the_cost_has_no_derivative() -> None:
    start = np.array([np.nan, 1.0])
    report = levenberg_marquardt_step(start, rosenbrock, np.add, EVERYTHING, FIRST_DAMPING)
    assert report.state is start
    assert not report.accepted


def test_no_terms_cost_nothing_as_a_float() -> None:
    assert isinstance(cost_of([]), float)  # messages take no integers


def test_weighted_normal_equations_are_those_of_the_textbook() -> None:
    rng = np.random.default_rng(0)
    r, J, w = rng.normal(size=9), rng.normal(size=(9, 4)), rng.random(9)
    equations = assemble([Residual(r[:5], J[:5], w[:5]), Residual(r[5:], J[5:], w[5:])], 4)
    np.testing.assert_allclose(equations.hessian, J.T @ np.diag(w) @ J, atol=1e-12)
    np.testing.assert_allclose(equations.gradient, J.T @ (w * r), atol=1e-12)
    np.testing.assert_array_equal(equations.hessian, equations.hessian.T)


def test_quadratic_terms_add_to_the_parameters_they_are_of() -> None:
    rng = np.random.default_rng(1)
    r, J, w = rng.normal(size=9), rng.normal(size=(9, 5)), rng.random(9)
    bend = rng.normal(size=(2, 2))
    model = Quadratic(0.7, rng.normal(size=2), bend @ bend.T, first=1)
    alone, both = (assemble(terms, 5) for terms in (
        [Residual(r, J, w)], [Residual(r, J, w), Quadratic(0.1), model]))
    grown, pulled = np.zeros((5, 5)), np.zeros(5)
    grown[1:3, 1:3], pulled[1:3] = model.hessian, model.gradient
    np.testing.assert_allclose(both.hessian, alone.hessian + grown, atol=1e-12)
    np.testing.assert_allclose(both.gradient, alone.gradient + pulled, atol=1e-12)
    assert np.isclose(both.cost, alone.cost + 0.8)


def test_a_damped_step_solves_the_damped_system_of_what_may_move() -> None:
    rng = np.random.default_rng(2)
    J, gradient = rng.normal(size=(9, 5)), rng.normal(size=5)
    equations = NormalEquations(1.0, gradient, J.T @ J)
    for active in (np.ones(5, dtype=bool), np.array([True, False, True, True, False])):
        free = np.flatnonzero(active)
        system = (J.T @ J)[np.ix_(free, free)]
        damped = system + 0.3 * np.diag(np.diag(system))
        step = damped_step(equations, 0.3, active)
        np.testing.assert_allclose(step[free], -np.linalg.solve(damped, gradient[free]), rtol=1e-6)
        assert not step[~active].any()


def test_a_system_that_bends_downward_has_no_step() -> None:
    equations = NormalEquations(1.0, np.ones(3), -np.eye(3))
    with pytest.raises(np.linalg.LinAlgError):
        damped_step(equations, 1e-3, np.ones(3, dtype=bool))


def test_upper_triangles_are_mirrored() -> None:
    full = np.random.default_rng(3).normal(size=(6, 6))
    full = full + full.T
    np.testing.assert_array_equal(with_lower(np.triu(full)), full)
