"""What the completion network is shown of a person."""

import numpy as np
import pytest

from pop_core.completion.person_view import (
    CELL_M,
    HALF_M,
    RELIEF_M,
    VIEW_PX,
    view_person,
)
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection

CAMERA = Camera(320, 240, 260.0, 260.0, 159.5, 119.5)


def somebody(points: dict[int, tuple[float, float]], score: float = 0.9):
    keypoints, scores = np.full((15, 2), np.nan), np.zeros(15)
    for joint, pixel in points.items():
        keypoints[joint], scores[joint] = pixel, score
    return Detection(keypoints, scores, np.zeros(4))


def wall(depth_m: float) -> np.ndarray:
    return np.full((240, 320), depth_m, dtype=np.float32)


def test_points_go_to_the_view_and_back():
    view = view_person(wall(2.5), CAMERA, somebody({0: (180, 100), 5: (200, 140), 7: (150, 90)}))
    points = np.random.default_rng(0).uniform([-1, -1, 1.5], [1, 1, 4], (15, 3))
    assert np.allclose(view.to_camera(view.from_camera(points)), points)
    middle = np.array([[*view.middle * view.depth_m, view.depth_m]])
    assert np.allclose(view.from_camera(middle), 0.0)


def test_depth_is_told_relative_to_the_keypoints():
    depth_m = wall(3.0)
    depth_m[80:160, 120:200] = 2.0
    view = view_person(depth_m, CAMERA, somebody({0: (130, 90), 5: (190, 150), 7: (160, 100)}))
    assert view.depth_m == 2.0
    middle = VIEW_PX // 2
    assert view.relief_m[middle, middle] == 0.0
    beside = round(0.8 / CELL_M)  # 80 pixels at 2 m are 62 cm
    assert view.relief_m[middle, middle + beside] == pytest.approx(1.0)
    assert (view.measured[middle, 2:-2] == 1.0).all()  # of 2.6 m the image shows 2.46


def test_what_lies_far_behind_is_cut_off():
    depth_m = wall(8.0)
    depth_m[80:160, 120:200] = 2.0
    view = view_person(depth_m, CAMERA, somebody({0: (130, 90), 5: (190, 150), 7: (160, 100)}))
    assert view.relief_m.max() == np.float32(RELIEF_M)


def test_people_far_and_near_look_alike():
    views = []
    for z in (2.0, 4.0):
        depth_m = wall(z + 0.5)
        pixels = {j: (160 + 260 * x / z, 120 + 260 * y / z)
                  for j, (x, y) in enumerate([(-0.3, -0.4), (0.3, 0.4), (0.1, 0.0)])}
        u, v = np.meshgrid(np.arange(320), np.arange(240))
        near = (np.abs(u - 160) < 260 * 0.4 / z) & (np.abs(v - 120) < 260 * 0.5 / z)
        depth_m[near] = z
        views.append(view_person(depth_m, CAMERA, somebody(pixels)))
    assert np.allclose(views[0].keypoints, views[1].keypoints, atol=0.02)
    both = (views[0].measured > 0) & (views[1].measured > 0)
    assert (np.abs(views[0].relief_m - views[1].relief_m)[both] < 0.01).mean() > 0.97


def test_holes_and_what_lies_beyond_the_image_are_told_apart():
    depth_m = wall(2.0)
    depth_m[100:140, 60:110] = np.nan
    view = view_person(depth_m, CAMERA, somebody({0: (20, 90), 5: (60, 150), 7: (40, 100)}))
    assert view.measured[VIEW_PX // 2, 0] == -1.0
    hole = round(VIEW_PX / 2 + (85 - 40) / 260 * 2.0 / CELL_M)
    assert view.measured[VIEW_PX // 2, hole] == 0.0
    assert view.relief_m[VIEW_PX // 2, hole] == 0.0


def test_single_holes_are_filled_from_beside():
    depth_m = wall(2.0)
    holes = np.random.default_rng(1).random(depth_m.shape) < 0.15
    depth_m[holes] = np.nan
    view = view_person(depth_m, CAMERA, somebody({0: (160, 90), 5: (160, 150), 7: (150, 100)}))
    inside = view.measured >= 0
    assert (view.measured[inside] == 1).mean() > 0.97


def test_keypoints_tell_where_they_are_and_what_lies_beneath():
    depth_m = wall(3.0)
    depth_m[80:160, 120:200] = 2.0
    view = view_person(depth_m, CAMERA, somebody({0: (130, 90), 5: (190, 150), 7: (160, 100)}))
    x, y, score, found, beneath, known = view.keypoints[0]
    assert (x, y) == pytest.approx((-30 / 260 * 2.0, -30 / 260 * 2.0), abs=1e-6)
    assert (score, found, beneath, known) == pytest.approx((0.9, 1.0, 0.0, 1.0))
    assert not view.keypoints[1].any()  # was not found


def test_a_guess_on_an_occluder_does_not_say_how_far_the_person_is():
    depth_m = wall(3.0)
    depth_m[150:] = 1.0
    sure, guessed = somebody({0: (130, 90), 7: (160, 100)}), somebody({3: (150, 200)}, 0.3)
    both = Detection(
        np.where(np.isfinite(sure.keypoints_px), sure.keypoints_px, guessed.keypoints_px),
        np.maximum(sure.scores, guessed.scores), np.zeros(4))
    assert view_person(depth_m, CAMERA, both).depth_m == 3.0
    assert view_person(depth_m, CAMERA, guessed).depth_m == 1.0


def test_who_stands_in_front_does_not_say_how_far_the_person_is():
    depth_m = wall(3.0)
    depth_m[:, 120:200] = 1.5
    behind = somebody({0: (110, 100), 5: (130, 150), 7: (140, 90), 9: (150, 95)})
    assert view_person(depth_m, CAMERA, behind).depth_m == 1.5
    view = view_person(depth_m, CAMERA, behind, taken=depth_m < 2.0)
    assert view.depth_m == 3.0
    assert view.relief_m.min() == np.float32(-RELIEF_M)  # and yet is seen


def test_keypoints_beyond_the_image_move_no_window():
    here, stray = {0: (180, 100), 5: (200, 140), 7: (150, 90)}, {9: (2000, 100)}
    alone, both = (
        view_person(wall(2.5), CAMERA, somebody(points)) for points in (here, here | stray))
    assert np.array_equal(alone.keypoints, both.keypoints)
    assert np.array_equal(alone.middle, both.middle)


def test_keypoints_beyond_the_image_are_nowhere_near_its_border():
    depth_m = wall(3.0)
    depth_m[:, -1] = 9.0
    half = somebody({0: (310, 100), 5: (400, 150), 7: (410, 90), 9: (420, 95)})
    assert view_person(depth_m, CAMERA, half).depth_m == 3.0


def test_nothing_is_shown_of_nobody():
    assert view_person(wall(2.0), CAMERA, somebody({})) is None
    assert view_person(wall(np.nan), CAMERA, somebody({0: (100, 100), 7: (90, 80)})) is None


def test_a_view_is_as_wide_as_it_says():
    view = view_person(wall(2.0), CAMERA, somebody({0: (160, 120)}))
    # 2.6 m at 2 m are 338 of 320 pixels.
    row = view.measured[VIEW_PX // 2]
    assert np.count_nonzero(row >= 0) == pytest.approx(320 / (2 * HALF_M / 2.0 * 260) * 80, abs=1)
