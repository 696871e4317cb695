"""Looks for people beside the following: what comes in late, and what is forgotten."""

import math
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from threading import Timer

import numpy as np
import pytest
from support.late import Late
from support.one_person import CAMERA, lift_truth
from support.stage import Stage, only

from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.depth_noise import USUAL_NOISE
from pop_core.errors import PopError
from pop_core.geometry.camera import Camera
from pop_core.keypoints.lifting import LiftingConfig
from pop_core.pipeline import Scene
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.association import Expected
from pop_core.tracking.detection_schedule import DetectionSchedule, Gap
from pop_core.tracking.finder import Finder, found_people
from pop_core.tracking.late_belief import carried
from pop_core.tracking.looks import Glimpse, Look, Looks, Seen, Watcher
from pop_core.tracking.tracking_config import TrackingConfig

STEP_M = 0.03  # a slow walk at the stage's rate
NEAR_M = 0.05  # who sets out is followed late by a part of a step
OFTEN = TrackingConfig(detect_every=2)


class Slow:
    """Sees at once what there is to see, and tells of it when it is told to."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future, Seen]] = []
        self.looks = 0
        self.is_at_once = False
        self.soon_s = math.inf
        self.watcher: Watcher | None = None

    def submit(self, work: Callable[..., Seen], *frames: RgbdFrame) -> Future:
        self.looks += 1
        future: Future = Future()
        self.waiting.append((future, work(self.watcher, *frames)))
        if self.is_at_once:
            self.finish()
        elif self.soon_s < math.inf:
            Timer(self.soon_s, self.finish).start()
        return future

    def finish(self) -> None:
        """Tell what waits."""
        for future, look in self.waiting:
            future.set_result(look)
        self.waiting.clear()


@pytest.fixture
def slow() -> Slow:
    return Slow()


def watched(body: BodyModel, slow: Slow, finding: Late | None = None) -> Stage:
    """Return a stage that somebody slow looks at."""
    made = Stage(body, OFTEN, finding, lookout=slow)
    slow.watcher = made.tracker.pipeline
    return made


@pytest.fixture
def stage(body: BodyModel, slow: Slow, person: BodyParameters) -> Stage:
    """Somebody who is followed well; from now on looks take their time."""
    slow.is_at_once = True
    made = watched(body, slow)
    made.show(person, times=5)
    slow.is_at_once = False
    return made


def walked(person: BodyParameters, steps: int) -> BodyParameters:
    return person.replaced(transl=person.transl + [STEP_M * steps, 0.0, 0.0])


def off_m(stage: Stage, person: BodyParameters) -> float:
    here = only(stage.show(person))
    return float(np.linalg.norm(here.joints - joints(stage.body, person), axis=1).mean())


def test_nobody_waits_for_a_look_and_one_at_a_time_is_made(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    looks = slow.looks
    for step in range(8):
        assert off_m(stage, walked(person, step)) < NEAR_M
    assert slow.looks == looks + 1


def test_what_was_seen_frames_ago_pulls_nobody_back(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    for step in range(10):
        off_m(stage, walked(person, step))
    assert slow.waiting
    slow.finish()
    # Ten steps are 30 cm, farther than keypoints may lie off without a doubt.
    assert off_m(stage, walked(person, 10)) < NEAR_M
    track, = stage.tracker._tracks
    assert (track.misses, track.doubts) == (0, 0)


def test_somebody_new_begins_in_the_frame_that_was_looked_at(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    aside = person.replaced(transl=person.transl + [-0.9, 0.0, 0.2])
    stage.show(person, aside, times=3)
    assert slow.waiting
    slow.finish()
    stage.show(person, aside)
    assert [body.track.id for body in stage.show(person, aside)] == [0, 1]


def test_a_frame_of_a_slow_camera_waits_for_its_own_look(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    slow.soon_s = 0.005  # 15 Hz leave 22 ms
    aside = person.replaced(transl=person.transl + [-0.9, 0.0, 0.2])
    looks = slow.looks
    while slow.looks == looks:
        bodies = stage.show(person, aside)
    assert len(bodies) == 2


def test_a_camera_that_is_kept_up_with_badly_waits_for_no_look(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    slow.soon_s = 0.005
    aside = person.replaced(transl=person.transl + [-0.9, 0.0, 0.2])
    looks = slow.looks
    while slow.looks == looks:
        bodies = stage.show(person, aside, skipped=1)
    assert len(bodies) == 1


@pytest.mark.parametrize('is_reset', [True, False], ids=['reset', 'jump back in time'])
def test_an_error_of_a_look_from_before_another_recording_is_nobodys(
    stage: Stage, slow: Slow, person: BodyParameters, is_reset: bool
) -> None:
    stage.show(person, times=3)
    (future, _), = slow.waiting
    slow.waiting.clear()
    future.set_exception(PopError('no keypoints'))
    slow.is_at_once = True
    if is_reset:
        stage.tracker.reset()
    else:
        stage.stamp_ns = 0
    assert off_m(stage, person) < NEAR_M


def test_an_error_of_a_late_look_is_raised_once(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    stage.show(person, times=3)
    (future, _), = slow.waiting
    slow.waiting.clear()
    future.set_exception(PopError('no keypoints'))
    with pytest.raises(PopError, match='no keypoints'):
        stage.show(person)
    assert off_m(stage, person) < NEAR_M


def test_who_is_followed_by_nobody_is_looked_for_at_once(
    body: BodyModel, slow: Slow, person: BodyParameters
) -> None:
    slow.is_at_once = True
    alone = watched(body, slow)
    assert only(alone.show(person)).track.id == 0


def a_frame() -> RgbdFrame:
    return RgbdFrame(
        np.zeros((2, 2, 3), np.uint8), np.ones((2, 2), np.float32),
        Camera(2, 2, 2.0, 2.0, 0.5, 0.5), 0)


def test_a_look_that_is_needed_at_once_is_taken_before_an_old_one(
    stage: Stage, slow: Slow, person: BodyParameters
) -> None:
    looks, old, new = Looks(slow), a_frame(), a_frame()
    assert looks.look(stage.tracker.pipeline, old, old, patience_s=0.0) is None
    assert looks.is_busy
    slow.is_at_once = True
    look = looks.look(stage.tracker.pipeline, new, new, patience_s=math.inf)
    assert look is not None
    assert look.frame is new
    assert not looks.is_busy
    assert looks.take() is None


def test_a_look_that_comes_in_while_it_is_waited_for_is_of_the_present_frame(
    stage: Stage, slow: Slow
) -> None:
    looks, frame = Looks(slow), a_frame()
    soon = Timer(0.05, slow.finish)
    soon.start()
    look = looks.look(stage.tracker.pipeline, frame, frame, patience_s=60.0)
    assert look is not None
    assert look.frame is frame
    assert not look.places
    assert not looks.is_busy


def test_a_look_that_takes_longer_comes_in_with_a_later_frame(
    stage: Stage, slow: Slow
) -> None:
    looks, frame = Looks(slow), a_frame()
    assert looks.look(stage.tracker.pipeline, frame, frame, patience_s=0.01) is None
    assert looks.is_busy
    slow.finish()
    look = looks.take()
    assert look is not None
    assert look.frame is frame


@pytest.mark.parametrize(('rate_hz', 'patience_s'), [
    (30.0, 0.0), (20.0, 0.0), (15.0, 1 / 45), (10.0, 1 / 30), (5.0, math.inf)])
def test_slow_cameras_leave_time_to_wait_for_a_look(rate_hz: float, patience_s: float) -> None:
    assert Gap(1.0 / rate_hz).patience_s == pytest.approx(patience_s)
    busy_s = patience_s if patience_s == math.inf else 0.0
    assert Gap(3.0 / rate_hz, skipped=2).patience_s == busy_s
    assert Gap(1.0 / rate_hz, is_hurried=True).patience_s <= 1.0 / 15.0


def test_without_help_every_look_is_waited_for(stage: Stage) -> None:
    looks, frame = Looks(), a_frame()
    look = looks.look(stage.tracker.pipeline, frame, frame, patience_s=0.0)
    assert look is not None
    assert look.frame is frame
    assert not looks.is_busy


def test_a_body_found_anew_is_compared_once_a_look_has_come_in(
    body: BodyModel, slow: Slow, late: Late, person: BodyParameters
) -> None:
    slow.is_at_once = True
    stage = watched(body, slow, finding=late)
    late.pipeline = stage.tracker.pipeline
    stage.show(person, times=5)
    away = person.replaced(transl=person.transl + [-0.75, 0.0, 0.0])  # where nobody can run to
    stage.show(away, times=3)
    slow.is_at_once = False
    stage.show(away, times=2)
    assert (late.asked, len(slow.waiting)) == (1, 1)
    late.finish()
    fresh = stage.tracker._fresh
    stage.show(away, times=2)
    assert fresh.is_busy  # it waits, and nobody for it
    slow.finish()
    assert off_m(stage, away) < NEAR_M
    assert not fresh.is_busy


def test_no_look_is_due_while_one_is_made() -> None:
    schedule = DetectionSchedule(TrackingConfig(detect_every=2))
    quick = Gap(1 / 30)
    assert not schedule.is_due([], quick, is_looking=True)
    assert not schedule.has_looked
    assert schedule.is_due([], quick)
    assert schedule.has_looked


def test_of_who_stood_behind_others_nothing_is_lifted_onto_where_they_were_then(
    body: BodyModel, person: BodyParameters
) -> None:
    nearer = person.replaced(transl=person.transl - [0.15, 0.0, 0.8])
    stage = Stage(body)
    frame = stage.frame(nearer, person, hidden=False)
    own = stage.frame(nearer, hidden=False).depth_m == frame.depth_m
    front = own & (frame.depth_m < person.transl[2] - 0.5)
    detection = stage.source.detection(frame, person)
    finder = Finder(stage.tracker.pipeline)
    found = found_people(frame, [detection], LiftingConfig())
    points = attached_positions(shared_points(body), body, person)
    behind = Expected(points, 0.01, ~front, front)
    old = Look(frame, Seen(found, None, USUAL_NOISE, {}), {
        0: Expected(points - [0.0, 0.0, 0.8], 0.01, front), 1: behind})
    present = Scene(
        replace(frame, stamp_ns=frame.stamp_ns + 33_000_000), None, USUAL_NOISE,
        np.roll(front, 40, axis=1))

    def strangers(look: Look) -> int:
        lifted = Glimpse(look, 0).joints(finder, present, 1, behind)
        return int((lifted.positions_camera[lifted.lifted, 2] < points[:, 2].min() - 0.3).sum())

    assert strangers(replace(old, places={})) > 0  # with the pixels of the present frame
    assert strangers(old) == 0
    np.testing.assert_array_equal(old.scene(present, 1).taken, front)
    np.testing.assert_array_equal(old.scene(present).taken, np.ones_like(front))
    assert not old.scene(present, 0).taken.any()
    np.testing.assert_array_equal(replace(old, places={}).scene(present).taken, present.taken)


def test_carried_joints_keep_their_errors_and_their_pixels_follow(
    body: BodyModel, person: BodyParameters
) -> None:
    lifted = lift_truth(body, person)
    noisy = replace(lifted, positions_camera=lifted.positions_camera + 0.02)
    there, here = (
        attached_positions(shared_points(body), body, p) for p in (person, walked(person, 2)))
    moved = carried(noisy, there, here, CAMERA)
    np.testing.assert_allclose(
        moved.positions_camera, here + 0.02 + (lifted.positions_camera - there), atol=1e-12)
    np.testing.assert_allclose(
        moved.keypoints_px - lifted.keypoints_px, CAMERA.project(here) - CAMERA.project(there),
        atol=1e-9)
    np.testing.assert_array_equal(moved.sigma_m, lifted.sigma_m)
