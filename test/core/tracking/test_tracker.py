"""One person before a wall, frame by frame: ids, states and ages, from first look to end."""

from dataclasses import replace

import numpy as np
import pytest
from support.one_person import CAMERA
from support.stage import RATE_HZ, Stage, only

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.errors import RepeatedStampError
from pop_core.estimate import TrackState
from pop_core.segmentation.ground import Ground
from pop_core.tracking.tracking_config import TrackingConfig


@pytest.fixture
def stage(body: BodyModel) -> Stage:
    return Stage(body)


def test_a_walker_keeps_the_id_and_is_followed(
    stage: Stage, body: BodyModel, person: BodyParameters
) -> None:
    for k in range(12):
        here = person.replaced(transl=person.transl + [0.04 * k, 0.0, 0.0])
        found = only(stage.show(here))
        assert found.track.id == 0
        if k == 0:
            assert found.track.state is TrackState.NEW
    assert found.track.state is TrackState.TRACKED
    assert found.track.age_s == pytest.approx(11 / RATE_HZ)
    assert found.track.unseen_s == 0.0
    off = np.linalg.norm(found.joints - joints(body, here), axis=1)
    assert off.mean() < 0.03  # the coarse mesh and the few steps of a tracked frame


def test_a_plane_above_the_feet_of_who_is_followed_is_not_their_floor(
    stage: Stage, body: BodyModel, person: BodyParameters, monkeypatch: pytest.MonkeyPatch
) -> None:
    feet_m = joints(body, person)[:, 1].max()
    seat = Ground(np.array([0.0, -1.0, 0.0]), feet_m - 0.45)
    monkeypatch.setattr('pop_core.tracking.looks.find_ground', lambda _: seat)
    found = only(stage.show(person, times=12))
    off = np.linalg.norm(found.joints - joints(body, person), axis=1)
    assert off.max() < 0.06


def test_the_detector_is_asked_every_few_frames_only(
    body: BodyModel, person: BodyParameters
) -> None:
    stage = Stage(body, TrackingConfig(detect_every=round(3 * 30.0 / RATE_HZ)))
    stage.show(person, times=4)
    before = stage.source.asked
    stage.show(person, times=9)
    assert stage.source.asked - before == 3


def test_somebody_hidden_is_predicted_with_growing_doubt_and_then_lost(
    body: BodyModel, person: BodyParameters
) -> None:
    stage = Stage(body, TrackingConfig(predicted_s=0.5))
    seen = only(stage.show(person, times=5))
    doubts = [np.trace(seen.joint_covariance[0])]
    for _ in range(5):
        found = only(stage.show(person, hidden=True))
        assert found.track.state is TrackState.PREDICTED
        assert not found.mask.any()
        doubts.append(np.trace(found.joint_covariance[0]))
    assert (np.diff(doubts) > 0).all()
    assert found.track.unseen_s == pytest.approx(5 / RATE_HZ)
    np.testing.assert_allclose(found.track.joint_unseen_s.min(), 5 / RATE_HZ)
    assert stage.show(person, hidden=True, times=5) == []


def test_somebody_found_again_within_three_seconds_is_the_same_person(
    stage: Stage, person: BodyParameters
) -> None:
    stage.show(person, times=5)
    stage.show(person, hidden=True, times=int(2.5 * RATE_HZ))
    again = person.replaced(transl=person.transl + [0.3, 0.0, 0.0])
    found = only(stage.show(again, times=3))
    assert found.track.id == 0
    assert found.track.state is TrackState.TRACKED


def test_somebody_found_later_is_somebody_new(stage: Stage, person: BodyParameters) -> None:
    stage.show(person, times=5)
    stage.show(person, hidden=True, times=int(3.5 * RATE_HZ))
    assert only(stage.show(person)).track.id == 1


def test_somebody_who_is_gone_is_not_given_out(stage: Stage, person: BodyParameters) -> None:
    stage.show(person, times=5)
    assert stage.show() == []


def test_a_jump_back_in_time_begins_anew_with_new_ids(
    stage: Stage, person: BodyParameters
) -> None:
    stage.show(person, times=5)
    stage.stamp_ns -= 2_000_000_000
    found = only(stage.show(person))
    assert (found.track.id, found.track.state, found.track.age_s) == (1, TrackState.NEW, 0.0)


def test_another_camera_begins_anew(stage: Stage, person: BodyParameters) -> None:
    stage.show(person, times=4)
    frame = stage.frame(person, hidden=False)
    other = replace(CAMERA, fx=CAMERA.fx * 1.02, fy=CAMERA.fy * 1.02)
    bodies = stage.tracker.process(replace(frame, camera=other)).bodies
    assert [body.track.id for body in bodies] == [1]


def test_a_camera_that_moves_by_hundredths_of_a_pixel_is_the_same(
    stage: Stage, person: BodyParameters
) -> None:
    stage.show(person, times=4)
    for k in range(1, 4):
        stage.stamp_ns += round(1e9 / RATE_HZ)
        moved = replace(CAMERA, fx=CAMERA.fx + 0.01 * k, cx=CAMERA.cx - 0.01 * k)
        frame = replace(stage.frame(person, hidden=False), camera=moved)
        assert only(list(stage.tracker.process(frame).bodies)).track.id == 0
    assert stage.tracker._last[0].sees_like(CAMERA)  # what is kept per camera stays


def test_a_camera_that_refocuses_sees_the_same_people(
    stage: Stage, person: BodyParameters
) -> None:
    stage.show(person, times=4)
    stage.stamp_ns += round(1e9 / RATE_HZ)
    moved = replace(CAMERA, fx=CAMERA.fx * 1.006, fy=CAMERA.fy * 1.006)
    frame = replace(stage.frame(person, hidden=False), camera=moved)
    assert only(list(stage.tracker.process(frame).bodies)).track.id == 0
    assert stage.tracker._last[0].sees_like(moved)


def test_a_reset_counts_from_zero(stage: Stage, person: BodyParameters) -> None:
    stage.show(person, times=2)
    stage.tracker.reset()
    assert only(stage.show(person)).track.id == 0


@pytest.mark.parametrize('later_ns', [0, 1, 33, 33_000], ids=['equal', 's', 'ms', 'us'])
def test_a_frame_of_the_moment_before_is_refused_and_changes_nothing(
    stage: Stage, body: BodyModel, person: BodyParameters, later_ns: int
) -> None:
    plain = Stage(body)
    for here in (stage, plain):
        here.show(person, times=3)
    moved = person.replaced(transl=person.transl + [0.2, 0.0, 0.0])
    frame = stage.frame(moved, hidden=False)
    with pytest.raises(RepeatedStampError, match=f'found {frame.stamp_ns + later_ns}'):
        stage.tracker.process(replace(frame, stamp_ns=frame.stamp_ns + later_ns))
    after, expected = (only(here.show(person)) for here in (stage, plain))
    np.testing.assert_array_equal(after.joints, expected.joints)
    assert (after.track.id, after.track.age_s) == (0, expected.track.age_s)


def test_a_frame_of_another_camera_may_have_the_stamp_before(
    stage: Stage, person: BodyParameters
) -> None:
    stage.show(person, times=3)
    other = replace(CAMERA, fx=CAMERA.fx * 1.02, fy=CAMERA.fy * 1.02)
    frame = replace(stage.frame(person, hidden=False), camera=other)
    assert only(list(stage.tracker.process(frame).bodies)).track.id == 1


def test_settings_change_without_losing_people(stage: Stage, person: BodyParameters) -> None:
    stage.show(person, times=4)
    stage.tracker.configure(stage.tracker.pipeline, TrackingConfig(steps=3))
    found = only(stage.show(person))
    assert (found.track.id, found.track.state) == (0, TrackState.TRACKED)


def test_smoothing_lags_behind_by_its_share(body: BodyModel, person: BodyParameters) -> None:
    plain, smooth = Stage(body), Stage(body, TrackingConfig(smoothing=0.8))
    moved = person.replaced(transl=person.transl + [0.05, 0.0, 0.0])
    for stage in (plain, smooth):
        stage.show(person, times=5)
    ahead, behind = (only(stage.show(moved)).joints[0, 0] for stage in (plain, smooth))
    assert 0.02 < ahead - behind < 0.05
