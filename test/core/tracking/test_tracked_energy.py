"""The prediction as a residual: zero where it is, whitened, with the derivative it claims."""

import numpy as np
import pytest

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.tracking.body_filter import first_state, predict
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
    np.testing.assert_allclose(predicted.residual(here, jacobian=False).r, 0.0, atol=1e-6)


def test_one_standard_deviation_costs_half(prediction: tuple[Prediction, BodyState]) -> None:
    predicted, here = prediction
    step = np.zeros(here.body.size)
    # Along one parameter alone, what the others would do is not given away.
    step[0] = 1 / np.sqrt(predicted.information[0, 0])
    r = predicted.residual(here.moved(step), jacobian=False).r
    assert 0.5 * r @ r == pytest.approx(0.5)


def test_the_jacobian_is_the_derivative(prediction: tuple[Prediction, BodyState]) -> None:
    predicted, here = prediction
    rng = np.random.default_rng(2)
    away = here.moved(0.2 * rng.normal(size=here.body.size))
    J = predicted.residual(away, jacobian=True).J
    assert J is not None
    direction = rng.normal(size=here.body.size)
    small = 1e-6
    plus, minus = (
        predicted.residual(away.moved(sign * small * direction), jacobian=False).r
        for sign in (1, -1))
    np.testing.assert_allclose(
        J @ direction, (plus - minus) / (2 * small), rtol=1e-4, atol=1e-4)


def test_a_joint_at_the_end_of_a_limb_is_the_least_certain(
    prediction: tuple[Prediction, BodyState]
) -> None:
    predicted, _ = prediction
    pelvis, wrist = 0, 13
    assert predicted.landmark_sigma_m[wrist] > predicted.landmark_sigma_m[pelvis]
