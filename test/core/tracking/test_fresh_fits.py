"""People found anew beside the others: who waits, who does not, and what comes in late."""

from collections.abc import Callable
from concurrent.futures import Executor, Future

import numpy as np
import pytest
from support.stage import RATE_HZ, Stage, only

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.estimate import EstimateStatus, TrackState
from pop_core.pipeline import PersonFit
from pop_core.tracking.detection_schedule import LONG_GAP_S, DetectionSchedule, Gap
from pop_core.tracking.fresh_fits import FreshFits
from pop_core.tracking.tracking_config import TrackingConfig

STEP_M = 0.05


class Late(Executor):
    """Does what it is given when it is told to."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future, Callable]] = []
        self.asked = 0

    def submit(self, work: Callable) -> Future:
        self.asked += 1
        self.waiting.append((Future(), work))
        return self.waiting[-1][0]

    def finish(self) -> None:
        for future, work in self.waiting:
            try:
                future.set_result(work())
            except ZeroDivisionError as error:
                future.set_exception(error)
        self.waiting.clear()


def walk(person: BodyParameters, step: int) -> BodyParameters:
    return person.replaced(transl=person.transl + [STEP_M * step, 0.0, 0.0])


@pytest.fixture
def late() -> Late:
    return Late()


@pytest.fixture
def stage(body: BodyModel, late: Late) -> Stage:
    return Stage(body, executor=late)


def test_somebody_new_comes_in_where_they_have_walked_to_meanwhile(
    stage: Stage, late: Late, body: BodyModel, person: BodyParameters
) -> None:
    for step in range(6):
        assert stage.show(walk(person, step)) == []
    assert stage.statuses == ()  # no look while nobody could begin
    assert late.asked == 1
    late.finish()
    found = only(stage.show(walk(person, 6)))
    assert (found.track.id, found.track.age_s) == (0, pytest.approx(6 / RATE_HZ))
    off = np.linalg.norm(found.joints - joints(body, walk(person, 6)), axis=1)
    assert off.mean() < 0.04
    found = only(stage.show(walk(person, 7)))
    assert found.track.state is TrackState.TRACKED


def test_a_person_who_waits_is_said_to(stage: Stage, person: BodyParameters) -> None:
    stage.show(person)
    assert stage.statuses == (EstimateStatus.WAITING,)


def test_people_followed_do_not_wait_for_one_who_is_looked_for_anew(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person)
    late.finish()
    stage.show(person, times=4)
    stage.stamp_ns += 300_000_000  # the camera paused
    shown = [only(stage.show(person))]
    assert late.asked == 2
    shown += [only(stage.show(person)) for _ in range(3)]
    late.finish()
    shown.append(only(stage.show(person)))
    assert {body.track.id for body in shown} == {0}


def test_what_is_found_after_a_reset_belongs_to_nobody(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person)
    stage.tracker.reset()
    late.finish()
    assert stage.show(person) == []
    assert late.asked == 2


def test_a_jump_back_in_time_forgets_who_was_being_fitted(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person)
    stage.stamp_ns -= 2_000_000_000
    late.finish()
    assert stage.show(person) == []


def test_an_error_of_a_late_fit_is_raised_once_and_people_are_found_after_it() -> None:
    late, made = Late(), []
    fits = FreshFits(late)
    fits.ask(lambda: 1 / 0, None, 0)
    late.finish()
    assert fits.poll()
    with pytest.raises(ZeroDivisionError):
        fits.take(None)
    fits.ask(lambda: made.append(1) or PersonFit(EstimateStatus.OK), None, 7)
    late.finish()
    assert fits.poll()
    assert fits.take(None).stamp_ns == 7


def test_a_fit_is_ready_for_whole_frames_only_and_for_its_owner_only() -> None:
    late = Late()
    fits = FreshFits(late)
    fits.ask(lambda: PersonFit(EstimateStatus.OK), 3, 0)
    late.finish()
    assert fits.take(3) is None  # it became ready within the frame
    assert fits.poll()
    assert fits.take(None) is None
    assert fits.take(3) is not None
    assert not fits.is_busy


def test_a_fit_of_a_track_that_has_ended_keeps_nobody_waiting() -> None:
    fits = FreshFits(Late())
    fits.ask(lambda: PersonFit(EstimateStatus.OK), 3, 0)
    fits.forget_unless({3})
    assert fits.is_busy
    fits.forget_unless({4})
    assert not fits.is_busy


def test_a_gap_of_our_own_making_is_no_slow_camera() -> None:
    gap_s = 10 / 30
    assert Gap(gap_s).is_of_slow_camera
    assert not Gap(gap_s, skipped=9).is_of_slow_camera
    assert Gap(gap_s, skipped=9).is_long
    assert not Gap(LONG_GAP_S / 2).is_long


def test_a_long_look_is_no_reason_for_the_next_one(stage: Stage, person: BodyParameters) -> None:
    schedule = DetectionSchedule(TrackingConfig(detect_every=3))
    followed = Stage(stage.body)
    followed.show(person, times=4)
    tracks = followed.tracker._tracks
    slow, own, quick = Gap(0.3), Gap(0.3, skipped=8), Gap(1 / 30)
    assert schedule.is_due(tracks, quick)
    assert not schedule.is_due(tracks, own)  # the look before took that long
    assert schedule.is_due(tracks, own)  # something else did
    assert schedule.is_due(tracks, slow)
    assert [schedule.is_due(tracks, quick) for _ in range(4)] == [False, False, True, False]


def test_a_node_that_was_slow_once_does_not_stay_slow(
    body: BodyModel, person: BodyParameters
) -> None:
    stage = Stage(body)
    stage.show(person, times=4)
    looked = stage.source.asked
    stage.stamp_ns += round(10e9 / 30)
    fitted = stage.count_fits()
    for skipped in (10, 0, 0):
        only(stage.show(person, skipped=skipped))
    assert stage.source.asked == looked + 1
    assert fitted == []
