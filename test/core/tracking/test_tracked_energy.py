"""The prediction as a term: no cost where it is, half by a sigma, derivatives as claimed."""

import numpy as np
import pytest
from support.derivatives import assert_is_gradient

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.tracking.body_filter import difference, first_state, predict
from pop_core.tracking.tracked_energy import Prediction


@pytest.fixture
def prediction(body: BodyModel, person: BodyParameters) -> tuple[Prediction, BodyState]:
    state = FitBody(body, full=False).state(person)
    belief = predict(first_state(person, 1e3 * np.eye(state.body.size)), body, 0.1)
    here = FitBody(body, full=False).state(belief.parameters)
    return Prediction(belief, here), here


def test_nothing_pulls_a_body_that_is_where_it_was_predicted(
    prediction: tuple[Prediction, BodyState]
) -> None:
    predicted, here = prediction
    assert predicted.term(here, jacobian=False).cost == pytest.approx(0.0, abs=1e-9)


def test_one_standard_deviation_costs_half(prediction: tuple[Prediction, BodyState]) -> None:
    predicted, here = prediction
    step = np.zeros(here.body.size)
    # Along one parameter alone, what the others would do is not given away.
    step[0] = 1 / np.sqrt(predicted.information[0, 0])
    assert predicted.term(here.moved(step), jacobian=False).cost == pytest.approx(0.5)


def test_the_gradient_is_the_derivative(prediction: tuple[Prediction, BodyState]) -> None:
    predicted, here = prediction
    away = here.moved(0.2 * np.random.default_rng(2).normal(size=here.body.size))
    assert_is_gradient(lambda s, j: predicted.term(s, jacobian=j), away)


def test_the_hessian_is_the_information_where_the_body_was_predicted(
    prediction: tuple[Prediction, BodyState]
) -> None:
    predicted, here = prediction
    np.testing.assert_allclose(
        predicted.term(here, jacobian=True).hessian, predicted.information, rtol=1e-6, atol=1e-6)


def test_the_hessian_elsewhere_is_that_of_the_turned_increments(
    prediction: tuple[Prediction, BodyState]
) -> None:
    predicted, here = prediction
    away = here.moved(0.2 * np.random.default_rng(2).normal(size=here.body.size))
    J = np.empty((here.body.size, here.body.size))
    for k in range(here.body.size):
        step = np.zeros(here.body.size)
        step[k] = 1e-6
        ahead, behind = (
            difference(away.moved(sign * step).parameters, predicted.parameters)
            for sign in (1, -1))
        J[:, k] = (ahead - behind) / 2e-6
    expected = J.T @ predicted.information @ J
    np.testing.assert_allclose(
        predicted.term(away, jacobian=True).hessian, expected,
        atol=1e-5 * np.abs(expected).max())


def test_a_joint_at_the_end_of_a_limb_is_the_least_certain(
    prediction: tuple[Prediction, BodyState]
) -> None:
    predicted, _ = prediction
    pelvis, wrist = 0, 13
    assert predicted.landmark_sigma_m[wrist] > predicted.landmark_sigma_m[pelvis]
