"""Near looks for training: one person at one size, with the truth of the camera they pretend."""

from itertools import pairwise

import cv2
import numpy as np
import pytest

from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth import canonical_view
from pop_core.keypoints.close_view import BEFORE_M, NetworkView, close_depth, close_view
from pop_core.synthesis.training_scenes import TrainingScene
from pop_core.training.close_scenes import FEWEST_SHOWN, seen_from_near
from pop_core.training.scene_writer import SceneKind, scene_stream
from pop_core.training.shards import MARGIN_PX

KIND = SceneKind((128, 160), 160.0, shown_at_m=2.0)


@pytest.fixture(scope='module')
def looks():
    stream = scene_stream(KIND, 5)
    return [stream.draw() for _ in range(40)]


def subject(look):
    """Return the person who is shown most; None where nobody is."""
    counts = np.bincount(look.owner[look.owner >= 0].astype(int), minlength=1)
    return int(counts.argmax()) if counts.any() else None


def test_people_are_shown_at_one_distance_and_some_looks_show_nobody(looks):
    assert looks[0].depth_m.shape == (160 + MARGIN_PX, 128 + MARGIN_PX)
    whole = [look for look in looks if subject(look) is not None]
    assert 0 < len(looks) - len(whole) < 12
    depth_m = [np.nanmedian(look.depth_m[look.owner == subject(look)]) for look in whole]
    assert np.median(np.abs(np.array(depth_m) - KIND.shown_at_m)) < 0.15
    assert all((look.owner == subject(look)).sum() >= FEWEST_SHOWN / 2 for look in whole)
    for look in looks:
        assert not (look.depth_m < KIND.shown_at_m - BEFORE_M).any()


def test_seen_joints_lie_a_little_behind_the_surface_that_is_shown(looks):
    behind = []
    for look in looks:
        for person in look.people:
            points = person.shared_points[person.visible & (person.shared_points[:, 2] > 0.3)]
            u, v = np.rint(look.camera.project(points)).astype(int).T
            inside = ((u >= 0) & (v >= 0) & (u < look.camera.width) & (v < look.camera.height))
            shown_m = look.depth_m[v[inside], u[inside]]
            behind += (points[inside, 2] - shown_m)[np.isfinite(shown_m)].tolist()
    assert len(behind) > 150
    assert 0.0 < np.median(behind) < 0.15
    assert np.mean(np.abs(behind) < 0.3) > 0.8


def a_scene(z_m=4.0):
    """Return a fine image of a wall with a step in it."""
    depth_m = np.full((100, 120), z_m, dtype=np.float32)
    depth_m[:, 60:] += 0.3
    depth_m[:, :10] = z_m - 3.0
    depth_m[0] = np.nan
    nobody = np.full(depth_m.shape, -1, dtype=np.int8)
    return TrainingScene(
        depth_m, nobody, nobody, (), Camera(120, 100, 100.0, 100.0, 59.5, 49.5))


def test_depth_is_shifted_and_not_scaled():
    view = NetworkView(Camera(96, 96, 50.0, 50.0, 47.5, 47.5), 2.0, 2.0, 1.2)
    look = seen_from_near(a_scene(), view)
    near, far = np.unique(look.depth_m[np.isfinite(look.depth_m)])
    assert near == pytest.approx(2.0)
    assert far - near == pytest.approx(0.3, abs=1e-6)
    # One pixel of the look is one of the fine image here: 2 x 50 px of focal length.
    step = np.flatnonzero(np.diff(look.depth_m[40]) > 0.2)
    assert step.tolist() == [47]


@pytest.mark.parametrize('enlarged', [0.7, 1.6])
def test_looks_to_learn_from_are_those_that_the_detector_shows(enlarged):
    rng = np.random.default_rng(4)
    camera = Camera(160, 120, 150.0, 150.0, 70.3, 66.1)
    depth_m = cv2.GaussianBlur(
        rng.uniform(1.0, 4.0, (120, 160)).astype(np.float32), (0, 0), 12.0) * 2.0 - 2.0
    nobody = np.full(depth_m.shape, -1, dtype=np.int8)
    scene = TrainingScene(depth_m, nobody, nobody, (), camera)
    joints = np.array([[-0.3, -0.4, 3.0], [0.4, 0.3, 3.0]])
    fine = canonical_view(camera, camera.ray_grid(), camera.fx)
    view = close_view(80.0, enlarged, joints, 3.0, fine)
    shown_m = np.nan_to_num(seen_from_near(scene, view).depth_m)
    expected_m = close_depth(depth_m, fine, view)
    assert (expected_m > 0).mean() > 0.2
    # Two roundings may choose the next pixel, which differs little here.
    assert np.mean(np.abs(shown_m - expected_m) < 0.02) > 0.97


def test_what_is_too_near_beyond_the_border_or_not_measured_is_missing():
    view = NetworkView(Camera(160, 128, 50.0, 50.0, 79.5, 63.5), 2.0, 2.0, 1.2)
    look = seen_from_near(a_scene(), view)
    assert look.depth_m.shape == (128, 160)
    rows, columns = np.nonzero(np.isfinite(look.depth_m))
    # 100 x 120 pixels in the middle, less the row that was not measured and what stands before.
    assert (rows.min(), rows.max()) == (15, 113)
    assert (columns.min(), columns.max()) == (30, 139)


def test_a_seed_gives_the_same_looks_again(looks):
    again = scene_stream(KIND, 5)
    for look in looks[:5]:
        other = again.draw()
        np.testing.assert_array_equal(other.depth_m, look.depth_m)
        for a, b in zip(other.people, look.people, strict=True):
            np.testing.assert_array_equal(a.shared_points, b.shared_points)
    assert any((a.depth_m.shape != b.depth_m.shape or not np.array_equal(
        a.depth_m, b.depth_m, equal_nan=True)) for a, b in pairwise(looks))
