"""Every term's Jacobian against central differences, at a pose where nothing is zero."""

import numpy as np
import pytest
from support.derivatives import assert_is_derivative, assert_is_gradient
from support.one_person import CAMERA, lift_truth

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.levenberg_marquardt import assemble, cost_of
from pop_core.fitting.observation import keypoint_rays
from pop_core.fitting.priors import (
    conditional_prior_term,
    limit_prior_term,
    pose_prior_term,
    scale_weight,
    shape_prior_term,
)
from pop_core.fitting.residuals import (
    Pairs,
    expected_residual,
    expected_weight,
    joint_residual,
    merged_pairs,
    no_pairs,
    pair_residual,
    ray_residual,
)
from pop_core.fitting.robust_loss import Power
from pop_core.fitting.self_collision import collision_residual
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.retrieval.pose_prior import load_pose_prior


@pytest.fixture
def state(body: BodyModel, person: BodyParameters) -> BodyState:
    rng = np.random.default_rng(3)
    bent = person.replaced(
        body_pose=person.body_pose + 0.3 * rng.normal(size=(23, 3)), scale=1.05)
    return FitBody(body, full=False).state(bent)


@pytest.fixture
def lifted(body: BodyModel, person: BodyParameters) -> LiftedJoints:
    return lift_truth(body, person)


def test_joint_term(state: BodyState, lifted: LiftedJoints) -> None:
    weight = np.ones(15)
    assert_is_derivative(lambda s, j: joint_residual(s, lifted, weight, jacobian=j), state)


def test_expected_term(state: BodyState, lifted: LiftedJoints) -> None:
    expected = JointBelief(lifted.positions_camera, np.full(15, 0.1))
    weight = expected_weight(state, expected, Power.STEP)
    assert (weight > 0).all()
    assert_is_derivative(lambda s, j: expected_residual(s, expected, weight, jacobian=j), state)


def test_what_is_expected_far_off_pulls_less(state: BodyState) -> None:
    off = np.zeros((15, 3))
    off[3, 0], off[4, 0] = 0.3, 3.0  # three and thirty sigmas
    expected = JointBelief(state.landmarks + off, np.full(15, 0.1))
    for power, share in ((Power.COMPARED, 0.5), (Power.STEP, 0.25)):
        weight = expected_weight(state, expected, power)
        assert np.allclose(np.delete(weight, [3, 4]), 100.0)
        assert weight[3] == pytest.approx(100.0 * share)
        assert weight[4] < 2.0
    assert not expected_weight(state, None, Power.STEP).any()


def test_ray_term(state: BodyState, lifted: LiftedJoints) -> None:
    blind = LiftedJoints(np.full((15, 3), np.nan), np.full(15, np.inf), lifted.state,
                         lifted.keypoints_px, lifted.scores)
    rays = keypoint_rays(blind, CAMERA)
    assert_is_derivative(lambda s, j: ray_residual(s, rays, np.ones(15), jacobian=j), state)


def test_surface_term(state: BodyState) -> None:
    rng = np.random.default_rng(4)
    vertex = rng.integers(0, len(state.vertices), 40)
    pairs = Pairs(vertex, rng.normal(size=(40, 3)), rng.normal(size=(40, 3)), np.ones(40))
    assert_is_derivative(lambda s, j: pair_residual(s, pairs, jacobian=j), state)


def test_pairs_of_one_vertex_are_worth_one_at_their_mean(state: BodyState) -> None:
    rng = np.random.default_rng(5)
    vertex = rng.integers(0, 50, 400)
    weight = np.where(vertex == vertex[0], 0.0, rng.uniform(0.0, 100.0, 400))
    every = Pairs(vertex, state.normals[vertex], rng.normal(size=(400, 3)), weight)
    merged, spread = merged_pairs(every)
    assert len(merged.vertex) == len(np.unique(vertex)) - 1  # a vertex without weight says nothing
    size = state.body.size
    moved = state.moved(0.01 * rng.normal(size=size))
    for at in (state, moved):
        many, few = (assemble([pair_residual(at, p, jacobian=True)], size)
                     for p in (every, merged))
        np.testing.assert_allclose(few.gradient, many.gradient, rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(few.hessian, many.hessian, rtol=1e-9, atol=1e-6)
        assert few.cost + spread == pytest.approx(many.cost, rel=1e-9)


def test_no_pairs_merge_to_none() -> None:
    merged, spread = merged_pairs(no_pairs())
    assert len(merged.vertex) == 0
    assert spread == 0.0


def test_a_term_without_weight_is_an_empty_block(
    state: BodyState, lifted: LiftedJoints
) -> None:
    rays = keypoint_rays(lifted, CAMERA)
    assert len(rays.joint) == 0
    for block in (
        joint_residual(state, lifted, np.zeros(15), jacobian=True),
        ray_residual(state, rays, np.zeros(15), jacobian=True),
        expected_residual(state, None, np.zeros(15), jacobian=True),
        collision_residual(state, 0.0, jacobian=True),
    ):
        assert len(block.r) == 0
        assert cost_of([block]) == 0.0
        assert not assemble([block], state.body.size).hessian.any()


def test_conditional_prior(state: BodyState, person: BodyParameters) -> None:
    sigma = np.linspace(0.2, 0.9, 23)
    assert_is_gradient(
        lambda s, j: conditional_prior_term(s, person.body_pose, sigma, 1.0, jacobian=j), state)
    assert conditional_prior_term(state, person.body_pose, sigma, 0.0, jacobian=True).cost == 0.0


def test_pose_prior(state: BodyState) -> None:
    prior = load_pose_prior()
    assert_is_gradient(lambda s, j: pose_prior_term(s, prior, 0.7, jacobian=j), state)


def test_limit_prior(state: BodyState) -> None:
    assert_is_gradient(lambda s, j: limit_prior_term(s, jacobian=j), state)


def test_shape_prior(state: BodyState) -> None:
    assert_is_gradient(lambda s, _: shape_prior_term(s, 0.3), state)


def test_small_people_may_be_children_but_there_are_no_giants(state: BodyState) -> None:
    def weight(scale: float) -> float:
        sized = state.body.state(state.parameters.replaced(scale=scale))
        return scale_weight(sized, Power.STEP)

    assert weight(1.3) == weight(1.0) == 1.0
    assert weight(0.7) < 0.1 < weight(0.95)


def test_hessians_of_priors_bend_the_cost_where_the_residuals_vanish(
    state: BodyState, person: BodyParameters
) -> None:
    """At a residual of zero the Gauss-Newton Hessian is the whole one."""
    sigma = np.linspace(0.2, 0.9, 23)
    there = state.parameters.body_pose
    rest = state.body.state(person.replaced(betas=np.zeros(len(person.betas)), scale=1.0))
    for term, at in (
        (lambda s: conditional_prior_term(s, there, sigma, 0.7, jacobian=True), state),
        (lambda s: shape_prior_term(s, 0.3), rest),
    ):
        model = term(at)
        assert model.cost == pytest.approx(0.0, abs=1e-12)
        own = slice(model.first, model.first + len(model.gradient))
        for seed in range(3):
            step = np.zeros(at.body.size)
            step[own] = 1e-3 * np.random.default_rng(seed).normal(size=own.stop - own.start)
            bent = 0.5 * step[own] @ model.hessian @ step[own]
            assert term(at.moved(step)).cost == pytest.approx(bent, rel=1e-2)


def test_joint_term_vanishes_at_the_lifted_joints(
    body: BodyModel, person: BodyParameters
) -> None:
    exact = lift_truth(body, person, sigma_m=1e-9)
    state = FitBody(body, full=False).state(person)
    r = joint_residual(state, exact, np.ones(15), jacobian=False).r
    np.testing.assert_allclose(r, 0, atol=1e-8)


def test_a_body_that_a_step_shrank_to_nothing_costs_much_and_nothing_fails(
    state: BodyState
) -> None:
    none = state.body.state(state.parameters.replaced(scale=0.0))
    assert 1e6 < shape_prior_term(none, 1.0).cost < np.inf
    assert np.isfinite(scale_weight(none, Power.STEP))
