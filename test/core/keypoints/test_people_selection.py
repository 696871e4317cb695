from dataclasses import replace

import numpy as np
import pytest
from keypoint_bodies import CAMERA, show

from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.people import detection_of
from pop_core.keypoints.people_selection import PeopleConfig, completed, select_people
from pop_core.rgbd import RgbdFrame

RIGHT_LEG = [SHARED_INDEX['right_knee'], SHARED_INDEX['right_ankle']]
LEFT_LEG = [SHARED_INDEX['left_knee'], SHARED_INDEX['left_ankle']]


def person(shift_px=0.0, score=0.9, noise_px=0.0, seed=0):
    body = show()
    uv = body.detection.keypoints_px + [shift_px, 0.0]
    uv = uv + np.random.default_rng(seed).normal(0, 1, (15, 2)) * noise_px
    return detection_of(uv, np.full(15, score))


def scene(*shifts_px):
    """The same body several times, side by side, before one wall."""
    body = show()
    depth = np.full_like(body.frame.depth_m, 4.5)
    for shift in shifts_px:
        moved = np.roll(body.frame.depth_m, int(shift), axis=1)
        depth = np.minimum(depth, moved)
    return RgbdFrame(body.frame.rgb, depth, CAMERA)


def test_two_people_side_by_side_are_both_kept():
    frame = scene(-100, 100)
    kept = select_people(frame, [person(-100), person(100, 0.8)])
    assert len(kept) == 2
    assert kept[0].score > kept[1].score


@pytest.mark.parametrize('copies', [1, 2, 4])
def test_copies_of_a_person_are_one_person(copies):
    frame = scene(0)
    doubles = [person(score=0.7, noise_px=4.0, seed=k) for k in range(copies)]
    kept = select_people(frame, [*doubles, person(score=0.9)])
    assert len(kept) == 1
    assert kept[0].score == pytest.approx(0.9)


def test_somebody_between_two_people_is_nobody():
    # Made of a side of each, and more certain than both.
    frame = scene(-60, 60)
    left, right = person(-60, 0.8), person(60, 0.8)
    both = np.arange(15) % 2 == 0
    mixed = np.where(both[:, None], left.keypoints_px, right.keypoints_px)
    chimera = detection_of(mixed, np.full(15, 0.95))
    kept = select_people(frame, [chimera, left, right])
    assert len(kept) == 2
    assert {round(float(p.scores.max()), 2) for p in kept} == {0.8}


def test_the_order_of_detections_does_not_matter():
    frame = scene(-100, 100)
    people = [person(-100), person(100, 0.8), person(-100, 0.6, noise_px=3.0), person(100, 0.5)]
    forward = select_people(frame, people)
    backward = select_people(frame, people[::-1])
    assert [p.score for p in forward] == [p.score for p in backward]


def test_keypoints_on_a_plain_wall_too_far_to_be_a_person_are_nobody():
    body = show()
    wall = np.full_like(body.frame.depth_m, 9.0)
    frame = replace(body.frame, depth_m=wall)
    assert select_people(frame, [body.detection]) == []


def test_people_without_depth_are_nobody():
    body = show()
    frame = replace(body.frame, depth_m=np.full_like(body.frame.depth_m, np.nan))
    assert select_people(frame, [body.detection]) == []


def test_an_uncertain_person_is_nobody():
    config = PeopleConfig(min_person_score=0.4)
    assert select_people(scene(0), [person(score=0.3)], config) == []
    assert len(select_people(scene(0), [person(score=0.5)], config)) == 1


def test_uncertain_keypoints_are_dropped_from_a_kept_person():
    found = person()
    scores = found.scores.copy()
    scores[RIGHT_LEG] = 0.1
    (kept,) = select_people(scene(0), [detection_of(found.keypoints_px, scores)])
    assert np.isnan(kept.keypoints_px[RIGHT_LEG]).all()
    assert (kept.scores[RIGHT_LEG] == 0).all()


def test_a_leg_that_only_the_double_told_apart_is_taken_over():
    good = person()
    uv = good.keypoints_px.copy()
    uv[RIGHT_LEG] = uv[LEFT_LEG]  # both legs on one
    confused, double = detection_of(uv, np.full(15, 0.9)), person(score=0.6)
    (kept,) = select_people(scene(0), [confused, double])
    np.testing.assert_allclose(kept.keypoints_px, good.keypoints_px)
    assert (kept.scores[RIGHT_LEG] == 0.6).all()


def test_completing_a_person_keeps_what_it_knows():
    first, second = person(score=0.9), person(score=0.99, noise_px=5.0)
    done = completed(first, second, same_place_px=10.0)
    assert np.array_equal(done.keypoints_px, first.keypoints_px)


def test_nobody_stays_nobody():
    assert select_people(scene(0), []) == []
