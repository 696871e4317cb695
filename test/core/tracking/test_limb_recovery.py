"""Lost limbs are looked for: found where they are, and not fitted where much speaks against it."""

from dataclasses import replace

import numpy as np
import pytest
from support.late import Late
from support.one_person import lift_truth, photograph
from support.stage import Scripted

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.observation import observe
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.late_limbs import (
    MOST_FAILURES,
    LateLimbs,
    LimbQuestion,
    find_limbs,
    with_found_limbs,
)
from pop_core.tracking.limb_recovery import LimbRecovery, LostLimbs
from pop_core.tracking.limbs import contradicted_joints
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import WarmStart

NOBODY_RESTS = np.zeros(24, dtype=bool)


@pytest.fixture(scope='module')
def pipeline(body: BodyModel) -> BodyPipeline:
    return BodyPipeline(body, default_library(), Scripted(body))


@pytest.fixture(scope='module')
def recovery(pipeline: BodyPipeline) -> LimbRecovery:
    config = TrackingConfig()
    return LimbRecovery(WarmStart(pipeline.fitter, config.prior_weight), config.steps)


def raised(person: BodyParameters, radians: float) -> BodyParameters:
    """Return a person whose left arm hangs differently."""
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1, 2] += radians
    return person.replaced(body_pose=pose)


def lost_limbs(
    pipeline: BodyPipeline, body: BodyModel, seen: BodyParameters, believed: BodyParameters
) -> LostLimbs:
    """Return a fit that began, and stayed, where a person is believed to be."""
    frame, lifted = photograph(body, seen), lift_truth(body, seen)
    observation = observe(frame, lifted, np.zeros(frame.depth_m.shape, dtype=bool))
    belief = first_state(believed, 1e6 * np.eye(pipeline.fitter.coarse.size))
    warm = WarmStart(pipeline.fitter, TrackingConfig().prior_weight)
    fit = warm.fit(belief, observation, 1, detected=False)
    return LostLimbs(belief, fit, observation, lifted, NOBODY_RESTS)


def test_a_limb_in_its_place_is_worth_a_fit(
    pipeline: BodyPipeline, recovery: LimbRecovery, body: BodyModel, person: BodyParameters
) -> None:
    true = raised(person, -0.9)
    lost = lost_limbs(pipeline, body, true, person)
    assert contradicted_joints(lost.body.state, lost.lifted).any()
    assert not recovery.is_in_vain(lost, true)


def test_a_limb_in_the_open_is_not(
    pipeline: BodyPipeline, recovery: LimbRecovery, body: BodyModel, person: BodyParameters
) -> None:
    lost = lost_limbs(pipeline, body, person, person)
    assert not contradicted_joints(lost.body.state, lost.lifted).any()
    assert recovery.is_in_vain(lost, raised(person, -0.9))


def test_a_lost_arm_is_found_and_a_resting_one_is_not_looked_for(
    pipeline: BodyPipeline, recovery: LimbRecovery, body: BodyModel, person: BodyParameters
) -> None:
    true = raised(person, -0.9)
    lost = lost_limbs(pipeline, body, true, person)
    assert lost.any_awake
    found = recovery.recover(lost)
    assert found.fit is not None
    assert [is_found for _, is_found in found.tried] == [True]
    off_m = np.linalg.norm(found.fit.state.joints - joints(body, true), axis=1)
    assert off_m.max() < 0.06
    asleep = replace(lost, resting=~NOBODY_RESTS)
    assert not asleep.any_awake
    assert recovery.recover(asleep).tried == ()


def test_a_limb_found_elsewhere_is_the_one_found_here_and_only_it_is_moved(
    pipeline: BodyPipeline, recovery: LimbRecovery, body: BodyModel, person: BodyParameters
) -> None:
    lost = lost_limbs(pipeline, body, raised(person, -0.9), person)
    here = recovery.recover(lost)
    answer = find_limbs(pipeline, LimbQuestion.of(lost, TrackingConfig()))
    (limb, is_found), = answer.tried
    assert is_found
    assert here.fit is not None
    np.testing.assert_allclose(
        answer.body_pose, here.fit.state.parameters.body_pose, atol=1e-6)
    belief = with_found_limbs(lost.belief, answer)
    moved = (belief.parameters.body_pose != person.body_pose).any(axis=1)
    np.testing.assert_array_equal(moved, limb[1:])
    grown = np.diag(belief.covariance) > np.diag(lost.belief.covariance)
    np.testing.assert_array_equal(grown[3:75].reshape(24, 3).all(axis=1), limb)
    assert grown.sum() == 3 * limb.sum()


def test_where_searches_fail_again_and_again_frames_wait_for_them_instead(
    pipeline: BodyPipeline, body: BodyModel, person: BodyParameters
) -> None:
    question = LimbQuestion.of(lost_limbs(pipeline, body, person, person), TrackingConfig())
    late = Late()
    limbs = LateLimbs(late)
    limbs.begin(wait=False)
    for track in range(MOST_FAILURES):
        assert not limbs.waits
        limbs.ask(track, question)
        late.fail()
        with pytest.raises(MemoryError):
            limbs.take(track)
    assert limbs.waits
