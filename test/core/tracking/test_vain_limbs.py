"""A limb that is found where much speaks against it costs no further fit."""

import numpy as np
import pytest
from support.one_person import lift_truth, photograph
from support.stage import Scripted

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.observation import observe
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.follower import Follower
from pop_core.tracking.limbs import contradicted_joints
from pop_core.tracking.tracking_config import TrackingConfig


@pytest.fixture(scope='module')
def follower(body: BodyModel) -> Follower:
    return Follower(BodyPipeline(body, default_library(), Scripted(body)), TrackingConfig())


def raised(person: BodyParameters, radians: float) -> BodyParameters:
    """Return a person whose left arm hangs differently."""
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1, 2] += radians
    return person.replaced(body_pose=pose)


def believed(
    follower: Follower, body: BodyModel, seen: BodyParameters, believed: BodyParameters,
    lifted: LiftedJoints,
) -> tuple:
    """Return a fit that began, and stayed, where a person is believed to be."""
    frame = photograph(body, seen)
    observation = observe(frame, lifted, np.zeros(frame.depth_m.shape, dtype=bool))
    belief = first_state(believed, 1e6 * np.eye(follower.pipeline.fitter.coarse.size))
    return follower.warm.fit(belief, observation, 1, detected=False), observation


def test_a_limb_in_its_place_is_worth_a_fit(
    follower: Follower, body: BodyModel, person: BodyParameters
) -> None:
    true, wrong = raised(person, -0.9), person
    lifted = lift_truth(body, true)
    fit, observation = believed(follower, body, true, wrong, lifted)
    assert contradicted_joints(fit.state, lifted).any()
    assert not follower._is_in_vain(true, fit, observation, lifted)


def test_a_limb_in_the_open_is_not(
    follower: Follower, body: BodyModel, person: BodyParameters
) -> None:
    wrong = raised(person, -0.9)
    lifted = lift_truth(body, person)
    fit, observation = believed(follower, body, person, person, lifted)
    assert not contradicted_joints(fit.state, lifted).any()
    assert follower._is_in_vain(wrong, fit, observation, lifted)
