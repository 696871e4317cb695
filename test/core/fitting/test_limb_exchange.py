"""Limbs move between hypotheses only where they explain more of what is seen."""

import numpy as np
import pytest
from support.one_person import CAMERA, lift_truth, photograph

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_state import FitBody
from pop_core.fitting.energy import PriorBelief
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.hypotheses import Hypothesis, HypothesisSteps
from pop_core.fitting.limb_exchange import LIMBS, exchange_limbs
from pop_core.fitting.observation import Observation, observe
from pop_core.fitting.trials import Judge
from pop_core.retrieval.pose_prior import load_pose_prior
from pop_core.segmentation.body_segmentation import SegmentationConfig

NOBODY = np.zeros((CAMERA.height, CAMERA.width), dtype=bool)
LEFT_ARM = LIMBS[0]


@pytest.fixture
def observation(body: BodyModel, person: BodyParameters) -> Observation:
    return observe(photograph(body, person), lift_truth(body, person), NOBODY)


@pytest.fixture
def judge(body: BodyModel, person: BodyParameters, observation: Observation) -> Judge:
    steps = HypothesisSteps(body, FittingConfig(), SegmentationConfig())
    truth = hypothesis(body, person, person.body_pose)
    segment = steps.common_segment([truth], observation)
    return lambda judged: steps.score(judged, observation, segment)


def hypothesis(body: BodyModel, person: BodyParameters, pose: np.ndarray) -> Hypothesis:
    return Hypothesis(
        FitBody(body, full=False).state(person.replaced(body_pose=pose)),
        PriorBelief(load_pose_prior(), pose, np.ones(23)))


def with_raised_left_arm(pose: np.ndarray) -> np.ndarray:
    raised = pose.copy()
    raised[JOINT_INDEX['left_shoulder'] - 1] += [0.0, 0.0, 1.4]
    return raised


def test_the_right_arm_of_a_wrong_body_is_taken(
    body: BodyModel, person: BodyParameters, judge: Judge
) -> None:
    best = hypothesis(body, person, with_raised_left_arm(person.body_pose))
    bent = np.where(LEFT_ARM[:, None], person.body_pose, person.body_pose + 0.5)
    donor = hypothesis(body, person, bent)
    judge([best, donor])
    found = exchange_limbs(best, [donor], judge)
    assert found.cost < best.cost
    np.testing.assert_allclose(found.state.parameters.body_pose, person.body_pose)
    np.testing.assert_allclose(found.belief.pose[LEFT_ARM], bent[LEFT_ARM])


def test_a_body_that_explains_everything_keeps_its_limbs(
    body: BodyModel, person: BodyParameters, judge: Judge
) -> None:
    best = hypothesis(body, person, person.body_pose)
    worse = hypothesis(body, person, with_raised_left_arm(person.body_pose))
    judge([best])
    assert exchange_limbs(best, [worse], judge) is best
    assert exchange_limbs(best, [], judge) is best


def test_limbs_are_disjoint_and_leave_the_trunk_alone() -> None:
    assert np.sum(LIMBS, axis=0).max() == 1
    trunk = [JOINT_INDEX[name] - 1 for name in ('spine1', 'spine2', 'spine3', 'neck', 'head')]
    assert not np.any(LIMBS, axis=0)[trunk].any()
