"""Limbs looked for beside the following: nobody waits, and what is found comes in later."""

import numpy as np
import pytest
from support.late import Late
from support.stage import Stage, only

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters

WRIST = JOINT_INDEX['left_wrist']


@pytest.fixture
def stage(body: BodyModel, late: Late) -> Stage:
    made = Stage(body, searching=late)
    late.pipeline = made.tracker.pipeline
    return made


@pytest.fixture
def waving(person: BodyParameters) -> BodyParameters:
    """The person with an arm where no arm gets to within a frame."""
    pose = person.body_pose.copy()
    pose[JOINT_INDEX['left_shoulder'] - 1] = [0.0, 0.0, 0.4]
    return person.replaced(body_pose=pose)


def off_m(stage: Stage, person: BodyParameters, times: int = 1) -> float:
    """Show a person; return how far their wrist is from where it should be."""
    shown = only(stage.show(person, times=times))
    return float(np.linalg.norm(shown.joints[WRIST] - joints(stage.body, person)[WRIST]))


def test_a_frame_does_not_wait_and_a_later_one_has_the_limb(
    stage: Stage, late: Late, person: BodyParameters, waving: BodyParameters
) -> None:
    stage.show(person, times=6)
    assert off_m(stage, waving, times=6) > 0.5
    assert late.asked == 1  # one search of a person at a time
    late.finish()
    assert off_m(stage, waving) < 0.1
    assert off_m(stage, waving, times=6) < 0.05


def test_slow_cameras_leave_time_to_search(
    stage: Stage, late: Late, person: BodyParameters, waving: BodyParameters
) -> None:
    stage.show(person, times=6)
    stage.stamp_ns += 200_000_000
    stage.show(waving)
    assert late.asked == 0


def test_an_error_of_a_search_is_raised_once_and_the_next_search_is_asked_for(
    stage: Stage, late: Late, person: BodyParameters, waving: BodyParameters
) -> None:
    stage.show(person, times=6)
    stage.show(waving, times=6)
    late.fail()
    with pytest.raises(MemoryError):
        stage.show(waving)
    stage.show(waving, times=6)
    assert late.asked == 2
    late.finish()
    assert off_m(stage, waving) < 0.1


def test_a_limb_that_was_found_in_time_is_not_moved_back_by_a_late_answer(
    stage: Stage, late: Late, person: BodyParameters, waving: BodyParameters
) -> None:
    stage.show(person, times=6)
    stage.show(waving, times=4)
    assert late.asked == 1
    stage.stamp_ns += 200_000_000  # time to search in the frame itself
    assert off_m(stage, person) < 0.05
    late.finish()
    assert off_m(stage, person) < 0.05
