"""A fit that begins rolled, crossed or back to front ends right."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX, SHARED_INDEX
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.fitting.body_fit import BodyFit, BodyFitter
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.bone_rolls import LIMBS, rolled_limbs
from pop_core.fitting.energy import PriorBelief
from pop_core.fitting.hypotheses import Hypothesis
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.plausibility import plausibility
from pop_core.fitting.readings import best_reading
from pop_core.fitting.side_exchange import turned_around, with_legs_exchanged
from pop_core.fitting.trials import Judge
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import load_pose_prior

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
LEFT_LEG, RIGHT_LEG, *_ = LIMBS
LEG_KEYPOINTS = tuple(SHARED_INDEX[f'{side}_{name}'] for side in ('left', 'right')
                      for name in ('knee', 'ankle'))
LEG_JOINTS = [JOINT_INDEX[f'{side}_{name}'] for side in ('left', 'right')
              for name in ('knee', 'ankle')]


@pytest.fixture(scope='module')
def fitter() -> BodyFitter:
    return BodyFitter(default_body(), load_pose_prior())


@pytest.fixture
def strider(person: BodyParameters) -> BodyParameters:
    """Seen half from the side: left leg forward and bent, right leg back."""
    pose = person.body_pose.copy()
    pose[LEFT_LEG.upper - 1, 0], pose[LEFT_LEG.hinge - 1, 0] = -0.9, 0.9
    pose[RIGHT_LEG.upper - 1, 0], pose[RIGHT_LEG.hinge - 1, 0] = 0.35, 0.25
    half_aside = from_rotvec(person.global_orient) @ from_rotvec(np.array([0.0, 0.7, 0.0]))
    return person.replaced(body_pose=pose, global_orient=to_rotvec(half_aside))


def observed(
    body: BodyModel, person: BodyParameters, hidden: tuple[int, ...] = ()
) -> Observation:
    return observe(photograph(body, person), lift_truth(body, person, hidden), NOBODY)


def hypothesis(body: BodyModel, parameters: BodyParameters) -> Hypothesis:
    return Hypothesis(
        FitBody(body, full=False).state(parameters),
        PriorBelief(load_pose_prior(), parameters.body_pose, np.ones(23)))


def judge_of(fitter: BodyFitter, judged: Hypothesis, observation: Observation) -> Judge:
    segment = fitter.steps.common_segment([judged], observation)
    return lambda each: fitter.steps.score(each, observation, segment)


def fit_from(
    fitter: BodyFitter, start: BodyParameters, observation: Observation
) -> BodyFit:
    p = attached_positions(shared_points(fitter.model), fitter.model, start)
    candidate = PoseCandidate(
        start.body_pose, p, start.scale, from_rotvec(start.global_orient), start.transl, 0.02,
        1.0, 0)
    return fitter.fit(observation, [candidate])


def errors(body: BodyModel, estimate: BodyParameters, truth: BodyParameters) -> np.ndarray:
    return np.linalg.norm(joints(body, estimate) - joints(body, truth), axis=1)


def with_rolled_thigh(body: BodyModel, person: BodyParameters) -> BodyParameters:
    """The left leg back to front, knee and ankle where they were: the knee bends forward."""
    bone, _ = LEFT_LEG.bones(body.joint_template)
    turn = from_rotvec(np.pi * bone / np.linalg.norm(bone))
    pose, R = person.body_pose.copy(), from_rotvec(person.body_pose)
    upper, hinge = LEFT_LEG.upper - 1, LEFT_LEG.hinge - 1
    pose[upper], pose[hinge] = to_rotvec(R[upper] @ turn), to_rotvec(turn.T @ R[hinge] @ turn)
    return person.replaced(body_pose=pose)


def test_a_rolled_leg_is_rolled_back_by_the_judge(
    fitter: BodyFitter, body: BodyModel, strider: BodyParameters
) -> None:
    observation = observed(body, strider)
    start = hypothesis(body, with_rolled_thigh(body, strider))
    assert rolled_limbs(start.state.parameters.body_pose) == [LEFT_LEG]
    judge = judge_of(fitter, start, observation)
    judge([start])
    found = best_reading(start, observation, judge)
    assert found.cost < start.cost
    assert rolled_limbs(found.state.parameters.body_pose) == []


def test_a_fit_from_a_rolled_leg_ends_right(
    fitter: BodyFitter, body: BodyModel, strider: BodyParameters
) -> None:
    result = fit_from(fitter, with_rolled_thigh(body, strider), observed(body, strider))
    assert rolled_limbs(result.parameters.body_pose) == []
    assert errors(body, result.parameters, strider)[LEG_JOINTS].max() < 0.05


def test_exchanged_legs_are_exchanged_back_where_no_keypoint_names_them(
    fitter: BodyFitter, body: BodyModel, strider: BodyParameters
) -> None:
    observation = observed(body, strider, LEG_KEYPOINTS)
    start = hypothesis(body, with_legs_exchanged(body, strider))
    judge = judge_of(fitter, start, observation)
    judge([start])
    found = best_reading(start, observation, judge)
    assert found.cost < start.cost
    error = errors(body, found.state.parameters, strider)[LEG_JOINTS]
    assert error.max() < 0.5 * errors(body, start.state.parameters, strider)[LEG_JOINTS].min()


def test_a_fit_from_exchanged_legs_ends_right(
    fitter: BodyFitter, body: BodyModel, strider: BodyParameters
) -> None:
    """Knees are named, feet are not."""
    ankles = tuple(SHARED_INDEX[f'{side}_ankle'] for side in ('left', 'right'))
    start = with_legs_exchanged(body, strider)
    assert errors(body, start, strider)[LEG_JOINTS].min() > 0.4
    result = fit_from(fitter, start, observed(body, strider, ankles))
    assert errors(body, result.parameters, strider)[LEG_JOINTS].max() < 0.05


def test_bodies_that_are_right_are_left_alone(
    fitter: BodyFitter, body: BodyModel, strider: BodyParameters
) -> None:
    for hidden in ((), LEG_KEYPOINTS):
        observation = observed(body, strider, hidden)
        start = hypothesis(body, strider)
        judge = judge_of(fitter, start, observation)
        judge([start])
        assert best_reading(start, observation, judge) is start
        assert not fit_from(fitter, strider, observation).sides_exchanged


def test_somebody_whose_back_was_taken_for_the_front_is_turned_about(
    fitter: BodyFitter, body: BodyModel, strider: BodyParameters
) -> None:
    """The detector names every joint after the other side, and retrieval believes it."""
    lifted = lift_truth(body, strider).with_sides_exchanged()
    observation = observe(photograph(body, strider), lifted, NOBODY)
    result = fit_from(fitter, turned_around(body, strider), observation)
    assert result.sides_exchanged
    assert errors(body, result.parameters, strider).mean() < 0.03
    assert plausibility(result, lifted) > 0.9  # keypoints agree, but for their names
    parameters = result.parameters
    finer = parameters.replaced(betas=np.concatenate([parameters.betas, np.full(40, 1.0)]))
    assert plausibility(replace(result, parameters=finer), lifted) > 0.9  # of a finer body model


def test_exchanging_sides_twice_changes_nothing(
    body: BodyModel, strider: BodyParameters
) -> None:
    observation = observed(body, strider, LEG_KEYPOINTS)
    again = observation.with_sides_exchanged().with_sides_exchanged()
    np.testing.assert_array_equal(
        again.lifted.positions_camera, observation.lifted.positions_camera)
    np.testing.assert_array_equal(again.keypoint_rays.joint, observation.keypoint_rays.joint)
