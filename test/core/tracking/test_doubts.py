"""When a person is looked for anew, and when a body is given up."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import facing_person
from support.stage import RATE_HZ, Stage, only

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.estimate import EstimateStatus, JointState, TrackState
from pop_core.tracking.detection_schedule import LONG_GAP_S, DetectionSchedule, Gap
from pop_core.tracking.doubts import count_misses, has_outgrown_evidence, is_doubtful, may_be
from pop_core.tracking.finder import FoundPerson
from pop_core.tracking.fresh_fits import FreshFit
from pop_core.tracking.rivals import lead
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracking_config import TrackingConfig

FRAME = Gap(1.0 / 30.0)
FRAME_NS = round(1e9 / RATE_HZ)


@pytest.fixture(scope='module')
def followed(body: BodyModel) -> Stage:
    stage = Stage(body)
    only(stage.show(facing_person(np.zeros(10)), times=5))
    return stage


@pytest.fixture
def track(followed: Stage) -> PersonTrack:
    return replace(followed.tracker._tracks[0])


def first_doubtful_s(track: PersonTrack) -> float:
    born_ns = track.restarted_ns = track.now_ns
    while not is_doubtful(track, FRAME):
        track.now_ns += FRAME_NS
    return (track.now_ns - born_ns) * 1e-9


def test_a_body_that_no_look_agreed_with_is_looked_for_soon_then_ever_more_rarely(
    track: PersonTrack
) -> None:
    track.doubts = 1
    waits = []
    for track.tries in (1, 2, 3, 4, 9):
        waits.append(first_doubtful_s(track))
    assert waits[0] < 0.3
    assert (np.diff(waits[:4]) > 0).all()
    assert waits[4] < 2.0
    track.tries, track.now_ns = 0, track.restarted_ns + 10 * FRAME_NS * 10
    assert not is_doubtful(track, FRAME)  # one contradiction of who was followed well


def test_who_is_followed_well_is_looked_for_ever_more_rarely_while_nothing_better_is_found(
    track: PersonTrack
) -> None:
    track.doubts, track.tries = 2, 0
    waits = []
    for track.rivals_beaten in (0, 1, 2, 9):
        waits.append(first_doubtful_s(track))
    assert (np.diff(waits[:3]) > 0).all()
    assert waits[3] == pytest.approx(waits[2])


def test_only_a_body_found_in_the_present_frame_of_a_slow_camera_needs_no_lead(
    track: PersonTrack
) -> None:
    leads = []
    for track.tries in (0, 1):
        leads.append(lead(track, track.now_ns))
    assert leads[0] > leads[1] > 0.0
    track.gap_s = 2 * LONG_GAP_S
    assert lead(track, track.now_ns) == 0.0
    assert lead(track, track.now_ns - FRAME_NS) == leads[1]


def test_looks_prove_a_body(followed: Stage, track: PersonTrack) -> None:
    assert track.is_proven
    assert track.tries == 0
    count_misses(track, False)
    count_misses(track, False)
    track.joint_state = np.full(24, JointState.SCENE_OCCLUDED)
    count_misses(track, False)
    assert track.state is TrackState.TRACKED  # hidden behind something, and known
    track.is_proven = False
    count_misses(track, False)
    assert track.state is TrackState.LOST
    assert track.has_ended(TrackingConfig())


def test_who_is_found_elsewhere_must_explain_keypoints_and_depth_as_usual(
    followed: Stage, person: BodyParameters, track: PersonTrack
) -> None:
    seen = only(followed.show(person))
    track.depth_level = seen.energies['E_depth']
    strange = seen.energies | {'E_depth': 2.0 * track.depth_level + 0.02}
    good, poor, astray = (
        FreshFit(FoundPerson(EstimateStatus.OK, body), 0)
        for body in (replace(seen, score=0.9), replace(seen, score=0.1),
                     replace(seen, score=0.9, energies=strange)))
    assert [may_be(track, fresh) for fresh in (good, poor, astray)] == [True, False, False]
    # Of who was lost for a while nobody knows how well depth agrees where they come out.
    track.seen_ns = track.now_ns - 10 * FRAME_NS
    assert [may_be(track, fresh) for fresh in (good, poor, astray)] == [True, False, True]


def test_evidence_is_outgrown_once_most_of_what_is_seen_is_new(track: PersonTrack) -> None:
    every = np.ones(15, dtype=bool)
    assert not has_outgrown_evidence(track, every)
    track.evidence = np.arange(15) < 7
    assert has_outgrown_evidence(track, every)
    assert not has_outgrown_evidence(track, np.arange(15) < 14)
    assert not has_outgrown_evidence(track, track.evidence)
    assert not has_outgrown_evidence(track, ~every)


def test_a_body_that_began_with_a_leg_is_looked_for_anew_once_when_the_rest_comes_out(
    body: BodyModel, person: BodyParameters
) -> None:
    stage = Stage(body)
    only(stage.show(person, times=2))
    fits = stage.count_fits()
    track = stage.tracker._tracks[0]
    born_ns = track.restarted_ns
    track.evidence[:] = False
    track.evidence[[SHARED_INDEX['left_knee'], SHARED_INDEX['left_ankle']]] = True
    only(stage.show(person, times=8))
    assert len(fits) == 1
    assert track.evidence.all()
    # That it agreed puts off no comparison that doubts ask for.
    assert track.restarted_ns == born_ns


def test_a_joint_that_comes_out_is_looked_at_in_the_next_frame(track: PersonTrack) -> None:
    schedule = DetectionSchedule(TrackingConfig(detect_every=5))
    track.note_look()
    assert schedule.is_due([track], FRAME)
    assert not schedule.is_due([track], FRAME)
    track.joint_state = np.full(24, JointState.SCENE_OCCLUDED)
    track.note_look()
    assert not schedule.is_due([track], FRAME)
    track.joint_state = np.full(24, JointState.VISIBLE)
    assert schedule.is_due([track], FRAME)
    track.note_look()
    assert not schedule.is_due([track], FRAME)


def test_a_body_that_no_look_agreed_with_is_looked_at_in_every_frame_for_a_moment(
    track: PersonTrack
) -> None:
    schedule = DetectionSchedule(TrackingConfig(detect_every=5))
    track.note_look()
    schedule.is_due([track], FRAME)
    track.tries = 1
    assert schedule.is_due([track], FRAME)
    track.state = TrackState.LOST
    assert not schedule.is_due([track], FRAME)
    track.tries, track.state = 9, TrackState.TRACKED
    assert not schedule.is_due([track], FRAME)
