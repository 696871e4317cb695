"""Bodies do not pass through themselves."""

import numpy as np
import pytest
from support.derivatives import assert_is_derivative

from pop_core.body.joint_limits import mirrored_pose
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, rest_parameters
from pop_core.fitting.body_state import BodyState, FitBody
from pop_core.fitting.levenberg_marquardt import (
    FIRST_DAMPING,
    Term,
    levenberg_marquardt_step,
)
from pop_core.fitting.priors import conditional_prior_term
from pop_core.fitting.self_collision import collision_residual, find_overlaps
from pop_core.synthesis.poses import POSE_KINDS, draw_pose

LEFT_SHOULDER, LEFT_ELBOW = (JOINT_INDEX[name] - 1 for name in ('left_shoulder', 'left_elbow'))


@pytest.fixture(scope='module')
def prepared(body: BodyModel) -> FitBody:
    return FitBody(body, full=False)


def posed(prepared: FitBody, pose: np.ndarray) -> BodyState:
    return prepared.state(rest_parameters().replaced(
        body_pose=pose, transl=np.array([0.1, 0.2, 2.0]), global_orient=np.array([3.0, 0.3, 0.1]),
        betas=np.linspace(-1, 1, 10), scale=0.9))


def tangled(seed: int) -> np.ndarray:
    """A pose of random joints, which no person can take."""
    return 1.5 * np.random.default_rng(seed).normal(size=(23, 3))


def arm_through_the_belly() -> np.ndarray:
    pose = np.zeros((23, 3))
    pose[LEFT_SHOULDER, 2] = -1.2
    pose[LEFT_ELBOW, 2] = -1.2
    return pose


def total(state: BodyState) -> float:
    return float(find_overlaps(state).depth_m.sum())


def test_jacobian(prepared: FitBody) -> None:
    state = posed(prepared, tangled(4))
    assert len(find_overlaps(state).depth_m) > 5
    assert_is_derivative(lambda s, j: collision_residual(s, 1.0, jacobian=j), state)


def test_the_t_pose_has_no_residual(prepared: FitBody) -> None:
    block = collision_residual(prepared.state(rest_parameters()), 1.0, jacobian=True)
    assert len(block.r) == 0
    assert block.J is not None
    assert block.J.shape == (0, prepared.size)


def test_people_do_not_overlap_with_themselves(body: BodyModel, prepared: FitBody) -> None:
    rng = np.random.default_rng(5)
    free = [total(posed(prepared, draw_pose(body, kind, rng).body_pose)) == 0
            for kind in POSE_KINDS for _ in range(12)]
    assert np.mean(free) > 0.9  # a hand may rest on a hip or a thigh


def test_mirrored_bodies_overlap_alike(body: BodyModel, prepared: FitBody) -> None:
    pose = tangled(4)
    depths = [find_overlaps(prepared.state(rest_parameters().replaced(body_pose=each))).depth_m
              for each in (pose, mirrored_pose(pose))]
    # The skin itself mirrors to a tenth of a millimetre.
    np.testing.assert_allclose(np.sort(depths[0]), np.sort(depths[1]), atol=2e-4)


def test_depth_does_not_depend_on_where_the_body_is(prepared: FitBody) -> None:
    state = posed(prepared, tangled(4))
    elsewhere = prepared.state(state.parameters.replaced(
        transl=np.array([-1.0, 0.0, 5.0]), global_orient=np.array([0.2, 1.0, -0.4])))
    np.testing.assert_allclose(
        find_overlaps(state).depth_m, find_overlaps(elsewhere).depth_m, atol=1e-9)


def test_an_arm_in_the_belly_comes_out(prepared: FitBody) -> None:
    start = arm_through_the_belly()
    state, damping = posed(prepared, start), FIRST_DAMPING
    assert find_overlaps(state).depth_m.max() > 0.04
    active = np.zeros(prepared.size, dtype=bool)
    active[6:75] = True

    def evaluate(at: BodyState, jacobian: bool) -> list[Term]:
        return [
            collision_residual(at, 1.0, jacobian=jacobian),
            conditional_prior_term(at, start, np.ones(23), 0.1, jacobian=jacobian)]

    for _ in range(10):
        report = levenberg_marquardt_step(state, evaluate, BodyState.moved, active, damping)
        state, damping = report.state, report.damping
    assert find_overlaps(state).depth_m.max(initial=0.0) < 0.003
    moved = np.linalg.norm(state.parameters.body_pose - start, axis=1)
    legs = [JOINT_INDEX[f'{side}_{name}'] - 1 for side in ('left', 'right')
            for name in ('hip', 'knee')]
    assert moved[legs].max() < 0.02  # the rest of the body stays


def test_tangled_bodies_have_finite_residuals(prepared: FitBody) -> None:
    for seed in range(20):
        block = collision_residual(posed(prepared, tangled(seed)), 1.0, jacobian=True)
        assert block.J is not None
        assert np.isfinite(block.r).all()
        assert np.isfinite(block.J).all()
