"""Jacobians of residuals against central differences."""

from collections.abc import Callable

import numpy as np

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.levenberg_marquardt import Residual

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
