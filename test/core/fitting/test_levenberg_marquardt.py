import numpy as np

from pop_core.fitting.levenberg_marquardt import (
    FIRST_DAMPING,
    Residual,
    assemble,
    cost_of,
    levenberg_marquardt_step,
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
