"""Two explanations of a person, each with a limb right that the other one has wrong."""

import numpy as np
import pytest
from support.lost_limb import lost_limbs, raised

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.pipeline import BodyPipeline
from pop_core.tracking.body_filter import FilterState
from pop_core.tracking.rivals import with_limbs_of
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import WarmStart

KNEE = JOINT_INDEX['left_knee'] - 1
STEPS = 2


@pytest.fixture(scope='module')
def warm(pipeline: BodyPipeline) -> WarmStart:
    return WarmStart(pipeline.fitter, TrackingConfig().prior_weight)


def followed(belief: FilterState) -> PersonTrack:
    return PersonTrack(
        id=0, filter=belief, born_ns=0, now_ns=0, seen_ns=0, joint_seen_ns=np.zeros(24, np.int64),
        mask=np.ones((1, 1), dtype=bool), joint_state=np.zeros(24, np.int64),
        hidden_at_look=np.zeros(24, dtype=bool), trust=1.0)


def kicking(person: BodyParameters) -> BodyParameters:
    """A person whose left lower leg points backward."""
    pose = person.body_pose.copy()
    pose[KNEE, 0] += 1.2
    return person.replaced(body_pose=pose)


def test_each_limb_is_taken_from_whom_it_explains_what_is_seen(
    pipeline: BodyPipeline, warm: WarmStart, body: BodyModel, person: BodyParameters
) -> None:
    true = raised(person, -0.9)
    with_leg_wrong, with_arm_wrong = (
        lost_limbs(pipeline, body, true, believed) for believed in (kicking(true), person))
    track = followed(with_leg_wrong.belief)
    mixed = with_limbs_of(
        warm, track, with_leg_wrong.body, with_arm_wrong.body, with_leg_wrong.observation,
        STEPS)
    assert mixed is not with_leg_wrong.body
    assert np.linalg.norm(mixed.state.joints - joints(body, true), axis=1).max() < 0.06
    # The belief is the one that the fit began with: the leg of the other, and little known of it.
    theirs = with_arm_wrong.body.state.parameters
    np.testing.assert_array_equal(
        track.filter.parameters.body_pose[KNEE], theirs.body_pose[KNEE])
    grown = np.diag(track.filter.covariance) > np.diag(with_leg_wrong.belief.covariance)
    assert grown[6 + 3 * KNEE: 9 + 3 * KNEE].all()


def test_a_body_that_has_every_limb_right_is_left_alone(
    pipeline: BodyPipeline, warm: WarmStart, body: BodyModel, person: BodyParameters
) -> None:
    right = lost_limbs(pipeline, body, person, person)
    wrong = lost_limbs(pipeline, body, person, raised(person, -0.9))
    track = followed(right.belief)
    assert with_limbs_of(
        warm, track, right.body, wrong.body, right.observation, STEPS
    ) is right.body
    assert track.filter is right.belief
