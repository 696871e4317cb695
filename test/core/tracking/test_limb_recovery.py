"""Lost limbs are looked for: found where they are, and not fitted where much speaks against it."""

from dataclasses import replace

import numpy as np
import pytest
from support.late import Late
from support.lost_limb import NOBODY_RESTS, lost_limbs, raised

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.pipeline import BodyPipeline
from pop_core.tracking.late_limbs import (
    LATEST_S,
    MOST_FAILURES,
    LateLimbs,
    LimbQuestion,
    find_limbs,
    with_found_limbs,
)
from pop_core.tracking.limb_recovery import LimbRecovery
from pop_core.tracking.limbs import contradicted_joints
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import WarmStart

FRAME_NS = 33_000_000


@pytest.fixture(scope='module')
def recovery(pipeline: BodyPipeline) -> LimbRecovery:
    config = TrackingConfig()
    return LimbRecovery(WarmStart(pipeline.fitter, config.prior_weight), config.steps)


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


@pytest.fixture
def question(pipeline: BodyPipeline, body: BodyModel, person: BodyParameters) -> LimbQuestion:
    return LimbQuestion.of(lost_limbs(pipeline, body, person, person), TrackingConfig())


def test_where_searches_fail_one_after_the_other_frames_wait_for_them_instead(
    pipeline: BodyPipeline, late: Late, question: LimbQuestion
) -> None:
    late.pipeline = pipeline
    limbs, now_ns = LateLimbs(late), 0

    def fail() -> None:
        nonlocal now_ns
        assert not limbs.waits
        limbs.ask(0, question)
        late.fail()
        now_ns += FRAME_NS
        with pytest.raises(MemoryError):
            limbs.begin(now_ns, has_time=False)

    limbs.begin(now_ns, has_time=False)
    for _ in range(MOST_FAILURES - 1):
        fail()
    limbs.ask(0, question)
    late.finish()
    limbs.begin(now_ns + FRAME_NS, has_time=False)
    assert limbs.take(0) is not None
    for _ in range(MOST_FAILURES):
        fail()
    assert limbs.waits


def test_what_was_found_long_ago_or_for_another_body_is_not_taken(
    pipeline: BodyPipeline, late: Late, question: LimbQuestion
) -> None:
    late.pipeline = pipeline
    limbs = LateLimbs(late)
    limbs.begin(0, has_time=False)
    for track in range(4):
        limbs.ask(track, question)
    limbs.forget(0)
    limbs.forget_unless({2, 3})
    late.finish()
    limbs.begin(FRAME_NS, has_time=False)
    assert [limbs.take(track) is not None for track in range(3)] == [False, False, True]
    assert limbs.take(2) is None
    limbs.begin(round(LATEST_S * 1e9) + FRAME_NS, has_time=False)
    assert limbs.take(3) is None
