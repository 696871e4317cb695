"""Laws of the filter: steps invert, doubt grows unseen and falls seen, speeds are learned."""

import numpy as np
import pytest

from pop_core.body.kinematics import increment, pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.tracking.body_filter import (
    FilterState,
    difference,
    first_state,
    inverse,
    predict,
    update,
    with_known_shape,
)
from pop_core.tracking.motion import N_MOVING, SPEED, motion_noise

FRAME_S = 1 / 30
SIZE = N_MOVING + 11


@pytest.fixture
def started(person: BodyParameters) -> FilterState:
    return first_state(person, 1e4 * np.eye(SIZE))


def measured(
    model: BodyModel, predicted: FilterState, truth: BodyParameters, information: np.ndarray
) -> FilterState:
    """The update by a linear measurement of all parameters."""
    before = inverse(predicted.covariance)
    gain = inverse(before + information) @ information
    step = gain @ difference(truth, predicted.parameters)
    skeleton = pose_skeleton(model, predicted.parameters)
    fitted = increment(predicted.parameters, step, skeleton)
    return update(predicted, fitted, before, information)


def is_positive(matrix: np.ndarray) -> bool:
    return bool(np.linalg.eigvalsh(matrix).min() > 0)


def whole(state: FilterState) -> np.ndarray:
    return np.block([
        [state.covariance, state.mixed], [state.mixed.T, state.velocity_covariance]])


def test_difference_inverts_increment(body: BodyModel, person: BodyParameters) -> None:
    step = 0.5 * np.random.default_rng(0).normal(size=SIZE)
    moved = increment(person, step, pose_skeleton(body, person))
    np.testing.assert_allclose(difference(moved, person), step, atol=1e-9)


def test_two_short_steps_of_the_process_are_one_long_step() -> None:
    first, second, both = motion_noise(0.1), motion_noise(0.2), motion_noise(0.3)
    np.testing.assert_allclose(first.decay * second.decay, both.decay)
    # Position after both: the first's, carried by its velocity, and the second's own.
    position = (first.position + 2 * second.reach_s * first.mixed
                + second.reach_s**2 * first.velocity + second.position)
    np.testing.assert_allclose(position, both.position, rtol=1e-9)
    velocity = second.decay**2 * first.velocity + second.velocity
    np.testing.assert_allclose(velocity, both.velocity, rtol=1e-9)


def test_velocities_settle_at_their_usual_spread() -> None:
    np.testing.assert_allclose(motion_noise(100.0).velocity, SPEED**2)


def test_a_body_nobody_sees_becomes_less_certain_and_stays_a_valid_belief(
    body: BodyModel, started: FilterState
) -> None:
    state, variances = started, [np.diag(started.covariance)]
    for _ in range(10):
        state = predict(state, body, FRAME_S)
        variances.append(np.diag(state.covariance))
        assert is_positive(whole(state))
    assert (np.diff(np.array(variances), axis=0) > 0).all()


def test_no_time_changes_nothing(body: BodyModel, started: FilterState) -> None:
    again = predict(started, body, 0.0)
    np.testing.assert_allclose(whole(again), whole(started), atol=1e-12)
    np.testing.assert_allclose(
        difference(again.parameters, started.parameters), 0.0, atol=1e-9)


def test_a_measurement_makes_more_certain_and_keeps_a_valid_belief(
    body: BodyModel, started: FilterState
) -> None:
    predicted = predict(started, body, FRAME_S)
    after = measured(body, predicted, started.parameters, 1e3 * np.eye(SIZE))
    assert (np.diag(after.covariance) < np.diag(predicted.covariance)).all()
    assert is_positive(whole(after))


def test_steady_motion_is_learned_and_carried_on(
    body: BodyModel, started: FilterState
) -> None:
    speed = np.zeros(SIZE)
    speed[0], speed[3 + 3 * 18 + 1] = 1.0, 2.0  # a walk to the right and a bending elbow
    truth, state = started.parameters, started
    for _ in range(10):
        truth = increment(truth, FRAME_S * speed, pose_skeleton(body, truth))
        state = measured(body, predict(state, body, FRAME_S), truth, 1e5 * np.eye(SIZE))
    truth = increment(truth, FRAME_S * speed, pose_skeleton(body, truth))
    ahead = difference(predict(state, body, FRAME_S).parameters, truth)
    # A fifth of what standing still would miss; velocities are thought to fade a little.
    assert np.abs(ahead[:N_MOVING]).max() < 0.2 * 2.0 * FRAME_S


def test_what_was_not_measured_keeps_its_doubt_and_its_place(
    body: BodyModel, started: FilterState
) -> None:
    predicted = predict(started, body, FRAME_S)
    information = np.zeros((SIZE, SIZE))
    information[:3, :3] = 1e5 * np.eye(3)
    after = measured(body, predicted, started.parameters, information)
    hidden = slice(3, N_MOVING)
    np.testing.assert_allclose(
        np.diag(after.covariance)[hidden], np.diag(predicted.covariance)[hidden], rtol=1e-4)
    np.testing.assert_allclose(after.velocity[hidden], predicted.velocity[hidden], atol=1e-9)


def test_thirty_frames_know_the_shape_better_than_one(
    body: BodyModel, person: BodyParameters
) -> None:
    rng = np.random.default_rng(1)
    truth = person.replaced(betas=np.full(10, 1.0))
    information = 4.0 * np.eye(SIZE)  # half a beta of noise
    information[:N_MOVING, :N_MOVING] = 1e5 * np.eye(N_MOVING)

    def glimpse() -> BodyParameters:
        return truth.replaced(betas=truth.betas + 0.5 * rng.normal(size=10))

    state = first_state(glimpse(), information)
    one = np.linalg.norm(state.parameters.betas - truth.betas)
    for _ in range(30):
        state = measured(body, predict(state, body, FRAME_S), glimpse(), information)
    assert np.linalg.norm(state.parameters.betas - truth.betas) < 0.6 * one


def test_a_new_pose_takes_over_the_shape_that_is_known(
    body: BodyModel, person: BodyParameters
) -> None:
    sure, vague = 1e4 * np.eye(SIZE), 1.0 * np.eye(SIZE)
    known = first_state(person.replaced(betas=np.full(10, 1.0)), sure)
    found = first_state(person.replaced(transl=person.transl + 1.0), vague)
    joined = with_known_shape(found, known, body)
    np.testing.assert_allclose(joined.parameters.betas, 1.0, atol=0.01)
    np.testing.assert_allclose(joined.parameters.transl, found.parameters.transl, atol=1e-6)
