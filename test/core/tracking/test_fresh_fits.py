"""People found anew beside the others: who waits, who does not, and what comes in late."""

from dataclasses import replace

import numpy as np
import pytest
from support.late import Late
from support.stage import RATE_HZ, Stage, only

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.depth_noise import USUAL_NOISE
from pop_core.estimate import EstimateStatus, TrackState
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.tracking.detection_schedule import LONG_GAP_S, DetectionSchedule, Gap
from pop_core.tracking.finder import FoundPerson
from pop_core.tracking.fresh_fits import FreshFits
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracker import CALM_FRAMES
from pop_core.tracking.tracking_config import TrackingConfig

STEP_M = 0.05
TO_THE_LEFT_M = -0.9


def newcomer(person: BodyParameters, step: int) -> BodyParameters:
    return person.replaced(transl=person.transl + [TO_THE_LEFT_M + STEP_M * step, 0.0, 0.2])


@pytest.fixture
def stage(body: BodyModel, late: Late) -> Stage:
    made = Stage(body, finding=late)
    late.pipeline = made.tracker.pipeline
    return made


def test_nobody_waits_where_nobody_is_followed(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    assert only(stage.show(person)).track.id == 0
    assert late.asked == 0


def test_slow_cameras_leave_time_to_wait(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person)
    stage.stamp_ns += 1_000_000_000
    assert len(stage.show(person, newcomer(person, 0))) == 2
    assert late.asked == 0


def test_slow_cameras_that_are_too_fast_for_us_leave_no_time(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person)
    stage.stamp_ns += 400_000_000
    stage.show(person, skipped=1)  # two images in 0.47 s: it was no time to wait
    stage.stamp_ns += 150_000_000
    assert only(stage.show(person, newcomer(person, 0))).track.id == 0
    assert late.asked == 1
    for _ in range(CALM_FRAMES):
        stage.stamp_ns += 150_000_000
        stage.show(person)
    assert stage.tracker._gap.has_time


def test_somebody_new_comes_in_where_they_have_walked_to_meanwhile(
    stage: Stage, late: Late, body: BodyModel, person: BodyParameters
) -> None:
    stage.show(person, times=5)
    for step in range(6):
        assert only(stage.show(person, newcomer(person, step))).track.id == 0
    assert late.asked == 1
    late.finish()
    here = newcomer(person, 6)
    _, found = stage.show(person, here)
    assert found.track.id == 1
    assert found.track.age_s <= 6 / RATE_HZ + 1e-6  # since the frame that was fitted
    off = np.linalg.norm(found.joints - joints(body, here), axis=1)
    assert off.mean() < 0.04
    _, found = stage.show(person, newcomer(person, 7))
    assert found.track.state is TrackState.TRACKED


def test_a_person_who_waits_is_said_to(stage: Stage, person: BodyParameters) -> None:
    stage.show(person, times=5)
    told = []
    for _ in range(3):
        stage.show(person, newcomer(person, 0))
        told += stage.statuses
    assert sorted(status.name for status in told) == ['OK', 'WAITING']


def test_people_followed_do_not_wait_for_one_who_is_looked_for_anew(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person, times=5)
    away = person.replaced(transl=person.transl + [-0.75, 0.0, 0.0])  # where nobody can run to
    shown = [stage.show(away) for _ in range(4)]
    assert late.asked == 1
    # Keypoints, which are not there in every frame, move them meanwhile.
    assert only(shown[-1]).joints[0] == pytest.approx(joints(stage.body, away)[0], abs=0.1)
    late.finish()
    assert only(stage.show(away)).joints[0] == pytest.approx(joints(stage.body, away)[0], abs=0.1)


def test_what_is_found_after_a_reset_belongs_to_nobody(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    stage.show(person, times=5)
    stage.show(person, newcomer(person, 0), times=3)
    assert late.asked == 1
    stage.tracker.reset()
    late.finish()
    assert only(stage.show(person)).track.id == 0


def asked(
    stage: Stage, late: Late, person: BodyParameters, track: int | None = None
) -> FreshFits:
    """Return fits one of which was asked for."""
    fits = FreshFits(late)
    frame = stage.frame(person, hidden=False)
    scene = Scene(frame, None, USUAL_NOISE, np.zeros(frame.depth_m.shape, dtype=bool))
    detection = stage.source.detection(frame, person)
    fits.ask(stage.tracker.pipeline, scene, detection, track, wait=False)
    return fits


def test_an_error_of_a_late_fit_is_raised_once(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    fits = asked(stage, late, person)
    late.fail()
    assert fits.poll()
    with pytest.raises(MemoryError):
        fits.take(None)
    assert not fits.is_busy


def waiting_newcomer(stage: Stage, person: BodyParameters) -> BodyParameters:
    """Somebody who came to a person who is followed, and is being fitted."""
    stage.show(person, times=5)
    here = newcomer(person, 0)
    stage.show(person, here, times=3)
    return here


def test_who_is_lost_to_an_error_is_found_without_help(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    here = waiting_newcomer(stage, person)
    late.fail()
    with pytest.raises(MemoryError):
        stage.show(person, here)
    assert len(stage.show(person, here, times=3)) == 2
    assert late.asked == 1


def test_who_was_fitted_in_vain_is_told_why(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    here = waiting_newcomer(stage, person)
    (future, *_), = late.waiting
    late.waiting.clear()
    future.set_result(FoundPerson(EstimateStatus.NO_SUPPORT))
    looks = stage.source.asked
    told = []
    for _ in range(7):
        stage.show(person, here)
        told += [status.name for status in stage.statuses if status is not EstimateStatus.OK]
    # Told once, and looked for again no sooner than others are.
    assert told[0] == 'NO_SUPPORT'
    assert set(told[1:]) == {'WAITING'}
    assert stage.source.asked - looks <= 4


def test_one_more_than_the_most_is_told_so(stage: Stage, person: BodyParameters) -> None:
    pipeline = stage.tracker.pipeline
    config = replace(pipeline.config, max_people=1)
    few = BodyPipeline(pipeline.model, pipeline.library, stage.source, config)
    stage.tracker.configure(few, TrackingConfig())
    stage.show(person, newcomer(person, 0))
    expected = [EstimateStatus.OK, EstimateStatus.TOO_MANY]
    assert sorted(stage.statuses, key=expected.index) == expected
    alone = few.process(stage.frame(*stage.source.people, hidden=False))
    assert sorted(alone.statuses, key=expected.index) == expected


def test_a_fit_is_ready_for_whole_frames_only_and_for_its_owner_only(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    fits = asked(stage, late, person, 3)
    late.finish()
    assert fits.take(3) is None  # it became ready within the frame
    assert fits.poll()
    assert fits.take(None) is None
    assert fits.take(3).person.status is EstimateStatus.OK
    assert not fits.is_busy


def test_a_fit_that_is_put_off_is_there_in_the_next_frame(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    fits = asked(stage, late, person, track=3)
    late.finish()
    assert fits.poll()
    fits.put_off()
    assert fits.take(3) is None
    assert fits.poll()
    assert fits.take(3) is not None


def test_a_fit_of_a_track_that_has_ended_keeps_nobody_waiting(
    stage: Stage, late: Late, person: BodyParameters
) -> None:
    fits = asked(stage, late, person, 3)
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


@pytest.fixture(scope='module')
def tracks(body: BodyModel, person: BodyParameters) -> list[PersonTrack]:
    """Somebody who is followed well."""
    stage = Stage(body)
    stage.show(person, times=4)
    return stage.tracker._tracks


QUICK = Gap(1 / 30)


def test_a_long_look_is_no_reason_for_the_next_one(tracks: list[PersonTrack]) -> None:
    schedule = DetectionSchedule(TrackingConfig(detect_every=3))
    slow, own = Gap(0.3), Gap(0.3, skipped=8)
    assert schedule.is_due(tracks, QUICK)
    assert not schedule.is_due(tracks, own)  # the look before took that long
    assert schedule.is_due(tracks, own)  # something else did
    assert schedule.is_due(tracks, slow)
    assert [schedule.is_due(tracks, QUICK) for _ in range(4)] == [False, False, True, False]


def test_cameras_of_other_rates_are_looked_at_as_often_in_time(
    tracks: list[PersonTrack]
) -> None:
    for rate_hz, looks in ((60.0, 20), (30.0, 20), (15.0, 15), (10.0, 20)):
        schedule = DetectionSchedule(TrackingConfig(detect_every=3))
        frames = round(2 * rate_hz)
        asked = sum(schedule.is_due(tracks, Gap(1 / rate_hz)) for _ in range(frames))
        assert asked == pytest.approx(looks, abs=1)


def test_where_nobody_was_seen_looks_are_as_rare_as_while_all_are_followed_well() -> None:
    schedule = DetectionSchedule(TrackingConfig(detect_every=3))
    asked = [schedule.is_due([], QUICK, is_empty=True) for _ in range(4)]
    assert asked == [True, False, False, True]
    assert schedule.is_due([], QUICK)  # somebody was seen, though not fitted yet


def test_an_empty_room_is_looked_at_now_and_then_and_who_comes_in_is_found(
    body: BodyModel, person: BodyParameters
) -> None:
    stage = Stage(body)
    stage.show(times=3)  # at 15 Hz every second frame is looked at
    assert stage.source.asked == 2
    assert [len(stage.show(person)) for _ in range(2)] == [0, 1]


def test_a_node_that_was_slow_once_does_not_stay_slow(
    stage: Stage, late: Late, body: BodyModel, person: BodyParameters
) -> None:
    stage.show(person)
    fitted = stage.count_fits()
    stage.stamp_ns += round(6e9 / RATE_HZ)  # for as long as the first body took
    for step, skipped in ((7, 6), (8, 0), (9, 0)):
        here = person.replaced(transl=person.transl + [STEP_M * step, 0.0, 0.0])
        found = only(stage.show(here, skipped=skipped))
        assert found.track.id == 0
        assert np.linalg.norm(found.joints - joints(body, here), axis=1).mean() < 0.04
    assert fitted == []
    assert late.asked == 0
