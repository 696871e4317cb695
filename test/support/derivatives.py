"""Derivatives of terms against central differences."""

from collections.abc import Callable

import numpy as np

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.levenberg_marquardt import Quadratic, Residual

STEP = 1e-6


def assert_is_derivative(term: Callable[[BodyState, bool], Residual], state: BodyState) -> None:
    block = term(state, True)
    assert block.J is not None
    assert len(block.r)
    for k in range(state.body.size):
        step = np.zeros(state.body.size)
        step[k] = STEP
        ahead, behind = term(state.moved(step), False), term(state.moved(-step), False)
        numeric = (ahead.r - behind.r) / (2 * STEP)
        np.testing.assert_allclose(block.J[:, k], numeric, rtol=2e-5, atol=1e-6)


def assert_is_gradient(term: Callable[[BodyState, bool], Quadratic], state: BodyState) -> None:
    model = term(state, True)
    assert model.gradient is not None
    assert model.gradient.any()
    gradient = np.zeros(state.body.size)
    gradient[model.first: model.first + len(model.gradient)] = model.gradient
    assert np.isclose(model.cost, term(state, False).cost, rtol=1e-9)
    for k in range(state.body.size):
        step = np.zeros(state.body.size)
        step[k] = STEP
        ahead, behind = term(state.moved(step), False), term(state.moved(-step), False)
        numeric = (ahead.cost - behind.cost) / (2 * STEP)
        np.testing.assert_allclose(gradient[k], numeric, rtol=1e-4, atol=1e-4)
