"""People out of a depth network's maps: perfect maps give back the truth."""

from dataclasses import replace

import numpy as np
import pytest
from support.depth_maps import shown_scene, truth_maps

from pop_core.body.default_body import default_body
from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth import canonical_depth, canonical_view
from pop_core.keypoints.close_view import NetworkView
from pop_core.keypoints.depth_grouping import group_cells
from pop_core.keypoints.depth_net import DepthNetDetector
from pop_core.keypoints.depth_network import EMBEDDED, OUTPUTS, DepthNetwork, close_path
from pop_core.keypoints.depth_votes import (
    NEAREST_M,
    Cells,
    DepthNetConfig,
    cell_depth,
    read_cells,
)
from pop_core.keypoints.onnx_session import load_network
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.keypoints.vote_fusion import fuse_votes
from pop_core.rgbd import RgbdFrame, undistort_frame
from pop_core.synthesis.coarse_body import coarse_body
from pop_core.synthesis.training_scenes import TrainingScenes

VGA = Camera(640, 480, 525.0, 525.0, 319.5, 239.5)


class PerfectNetwork(DepthNetwork):
    """A network that knows the scene, or only some cells of it."""

    def __init__(self, scene, *, is_close=False, share=1.0):
        """Take the scene."""
        super().__init__(load_network(close_path(EMBEDDED) if is_close else EMBEDDED))
        self.scene, self.share = scene, share

    def cells(self, shown_m, view, min_probability):
        """Return what a perfect network says of a view of the scene."""
        maps = truth_maps(shown_scene(self.scene, shown_m, view))
        cells = read_cells(maps, shown_m, view, min_probability)
        return cells.chosen(np.arange(round(self.share * len(cells))))


def perfect_detector(scene, *, has_close=True):
    """Return the detector with networks that know the scene."""
    close = PerfectNetwork(scene, is_close=True) if has_close else None
    return DepthNetDetector(PerfectNetwork(scene), close=close)


@pytest.fixture(scope='module')
def scenes():
    stream = TrainingScenes(coarse_body(default_body()), seed=21)
    return [stream.draw() for _ in range(24)]


def frame_of(scene):
    return RgbdFrame(np.zeros((*scene.depth_m.shape, 3), np.uint8), scene.depth_m, scene.camera)


def detections(scene, *, has_close=True):
    """Return what perfect maps of a scene are decoded into."""
    return perfect_detector(scene, has_close=has_close).detect(frame_of(scene))


def shown_people(scene, least_m2=0.06):
    """Return people of whom the sensor measures twice the surface that makes a person."""
    area_m2 = (np.nan_to_num(scene.depth_m) / scene.camera.fx) ** 2
    return [k for k in range(len(scene.people)) if area_m2[scene.owner == k].sum() > least_m2]


@pytest.mark.parametrize('has_close', [True, False], ids=['two networks', 'one network'])
def test_perfect_maps_give_everybody_once(scenes, has_close):
    for scene in scenes:
        wanted = len(shown_people(scene))
        there = sum((scene.owner == k).any() for k in range(len(scene.people)))
        assert wanted <= len(detections(scene, has_close=has_close)) <= there


def test_perfect_maps_give_joints_where_they_are_hidden_ones_too(scenes):
    checked = 0
    for scene in scenes:
        found = detections(scene)
        for k in shown_people(scene):
            person = scene.people[k]
            best = max(found, key=lambda d: (d.person_mask & (scene.owner == k)).sum())
            known = np.isfinite(best.joint_depth_m)
            points = scene.camera.unproject(
                best.keypoints_px[known], best.joint_depth_m[known])
            error = np.linalg.norm(points - person.shared_points[known], axis=1)
            # Skin draws seen joints half way to where it has them on a mean body, a few
            # centimetres off; holes filled from beside move a cell's surface.
            assert np.median(error) < 0.04
            np.testing.assert_array_equal(best.visible[known] > 0.5, person.visible[known])
            checked += known.sum()
    assert checked > 200


def test_masks_and_parts_cover_the_people_and_nothing_else(scenes):
    hit = said = there = right = 0
    for scene in scenes:
        found = detections(scene)
        mask = np.any([d.person_mask for d in found], axis=0) if found else scene.owner > 90
        truth = (scene.owner >= 0) & np.isfinite(scene.depth_m)
        hit, said, there = hit + (mask & truth).sum(), said + mask.sum(), there + truth.sum()
        for detection in found:
            own = detection.person_mask & truth
            right += (detection.part_labels >= 0)[own].sum()
            np.testing.assert_array_equal(detection.part_labels >= 0, detection.person_mask)
    assert hit / said > 0.9
    assert hit / there > 0.85
    assert right > 1000


def test_boxes_hold_the_mask_and_the_joints_that_are_seen(scenes):
    checked = 0
    for detection in (found for scene in scenes for found in detections(scene)):
        left, top, right, bottom = detection.box_px
        v, u = np.nonzero(detection.person_mask)
        assert left <= u.min() <= u.max() <= right
        assert top <= v.min() <= v.max() <= bottom
        sure = (detection.visible > 0.5) & (detection.scores > 0.3)
        uv = detection.keypoints_px[sure]
        assert (uv >= [left, top]).all()
        assert (uv <= [right, bottom]).all()
        checked += sure.sum()
    assert checked > 100


def doubting(scene, share):
    """Return a detector whose near looks see only a share of the cells."""
    return DepthNetDetector(
        PerfectNetwork(scene), close=PerfectNetwork(scene, is_close=True, share=share))


def test_whom_the_near_look_does_not_show_is_nobody(scenes):
    scene = next(scene for scene in scenes if detections(scene))
    detector = doubting(scene, 0.0)
    assert detector.first_look(frame_of(scene))
    assert detector.detect(frame_of(scene)) == []


def test_both_looks_say_how_surely_somebody_is_there(scenes):
    scene = next(scene for scene in scenes if detections(scene))
    first = perfect_detector(scene).first_look(frame_of(scene))
    scores = []
    for share in (0.3, 0.6, 1.0):
        look = doubting(scene, share).closer(frame_of(scene), first, 0)
        low, high = sorted([look.person.score, first[0].score])
        assert low <= look.score <= high
        scores.append(look.score)
    assert scores == sorted(scores)


class Shifted(PerfectNetwork):
    """A network that sees all joints beside where they are, and says how sure it is."""

    def __init__(self, scene, shift_m, sigma_m, *, is_close):
        super().__init__(scene, is_close=is_close)
        self.shift_m, self.sigma_m = shift_m, sigma_m

    def cells(self, shown_m, view, min_probability):
        """Return the cells with other votes."""
        cells = super().cells(shown_m, view, min_probability)
        return replace(cells, joints=cells.joints + [self.shift_m, 0.0, 0.0],
                       sigma_m=np.full_like(cells.sigma_m, self.sigma_m))


@pytest.mark.parametrize(('first_m', 'near_m', 'expected_m'), [
    (0.02, 0.08, 0.0), (0.08, 0.02, 0.04), (0.04, 0.04, 0.02)])
def test_joints_are_told_by_the_surer_look(scenes, first_m, near_m, expected_m):
    scene = next(scene for scene in scenes if detections(scene))
    detector = DepthNetDetector(
        Shifted(scene, 0.0, first_m, is_close=False),
        close=Shifted(scene, 0.04, near_m, is_close=True))
    first = detector.first_look(frame_of(scene))
    look = detector.closer(frame_of(scene), first, 0)
    offset = np.median(look.person.joints[:, 0] - first[0].person.joints[:, 0])
    assert offset == pytest.approx(expected_m, abs=0.012)


def test_an_empty_image_shows_nobody(scenes):
    empty = next(scene for scene in scenes if not (scene.owner >= 0).any())
    assert detections(empty) == []


def two_trunks(gap_m, rng, area_m2=1e-3):
    """Return cells of two equal people beside each other, votes with a centimetre of noise."""
    body = rng.normal(0, 0.3, (15, 3)) + [0, 0, 3.0]
    centres = np.repeat([[0.0, 0, 0], [gap_m, 0, 0]], 60, axis=0)
    joints = body + centres[:, None] + rng.normal(0, 0.01, (120, 15, 3))
    ones = np.ones((120, 15))
    return Cells(np.arange(120), np.arange(120), np.full(120, 2.9), np.full(120, area_m2),
                 np.full(120, 0.9), np.full((120, 16), 1 / 16), joints, 0.03 * ones, 0.5 * ones)


@pytest.mark.parametrize('gap_m', [0.45, 0.6, 1.0])
def test_trunks_apart_are_two_people(gap_m):
    cells = two_trunks(gap_m, np.random.default_rng(0))
    member = group_cells(cells, DepthNetConfig())
    assert set(member[:60]) != set(member[60:])
    assert member.max() == 1


def test_trunks_in_one_place_are_one_person():
    cells = two_trunks(0.05, np.random.default_rng(0))
    assert group_cells(cells, DepthNetConfig()).tolist() == [0] * 120


def test_a_speck_is_nobody():
    cells = two_trunks(1.0, np.random.default_rng(0), area_m2=1e-5)
    member = group_cells(cells, DepthNetConfig())
    assert member.tolist() == [-1] * 120


def test_wild_votes_hardly_move_a_joint():
    rng = np.random.default_rng(1)
    cells = two_trunks(0.0, rng)
    truth = fuse_votes(cells).joints
    cells.joints[:20] += rng.normal(0, 1.0, (20, 15, 3))
    np.testing.assert_allclose(fuse_votes(cells).joints, truth, atol=0.05)


def test_the_surest_cells_decide():
    cells = two_trunks(0.4, np.random.default_rng(2))
    cells.sigma_m[:60], cells.sigma_m[60:] = 0.01, 0.5
    sure = fuse_votes(cells.chosen(np.arange(60))).joints
    np.testing.assert_allclose(fuse_votes(cells).joints, sure, atol=0.01)


@pytest.mark.parametrize('camera', [
    VGA,
    Camera(1280, 720, 900.0, 905.0, 610.0, 380.0),
    Camera(640, 480, 525.0, 525.0, 319.5, 239.5, 'plumb_bob',
           np.array([0.1, -0.2, 0.001, 0.001, 0.05])),
], ids=['vga', 'hd', 'distorted'])
def test_canonical_pixels_and_measured_pixels_lie_on_the_same_rays(camera):
    view = canonical_view(camera, camera.ray_grid(), 160.0)
    assert view.camera.width % 32 == 0
    assert view.camera.height % 32 == 0
    grid, rays = view.camera.ray_grid(), camera.ray_grid()
    inside = view.source_v >= 0
    assert inside.mean() > 0.6
    there = rays[view.source_v[inside], view.source_u[inside]]
    np.testing.assert_allclose(there, grid[inside], atol=1.0 / camera.fx)  # half a pixel, doubled


def test_a_missing_pixel_takes_the_depth_beside_it():
    depth_m = np.full((480, 640), 2.0, dtype=np.float32)
    view = canonical_view(VGA, VGA.ray_grid(), 160.0)
    depth_m[view.source_v.max(axis=1)[20], view.source_u.max(axis=0)[30]] = np.nan
    seen = canonical_depth(depth_m, view)
    assert (seen[view.source_v >= 0] == 2.0).all()


def test_the_depth_of_a_cell_is_its_nearest():
    depth_m = np.zeros((8, 8), dtype=np.float32)
    depth_m[1, 2], depth_m[2, 1], depth_m[7, 7] = 2.0, 1.5, 3.0
    np.testing.assert_array_equal(cell_depth(depth_m), [[1.5, np.inf], [np.inf, 3.0]])


def test_votes_before_the_camera_stay_before_it_in_near_looks_too():
    """Whoever is shown farther than they are has votes that are behind the camera in truth."""
    view = NetworkView(Camera(32, 32, 160.0, 160.0, 15.5, 15.5), 0.3, -1.4)
    shown_m = np.full((32, 32), 2.0, dtype=np.float32)
    maps = [np.zeros((channels, 8, 8), np.float32) for _, channels in OUTPUTS]
    maps[0][1] = 9.0
    maps[1][2::3] = -1.0  # a metre before a surface at 0.6 m
    cells = read_cells(maps, shown_m, view, 0.5)
    assert len(cells) == 64
    np.testing.assert_allclose(cells.joints[..., 2], NEAREST_M)


def test_a_distorted_camera_sees_masks_and_parts_where_its_pinhole_has_the_people(scenes):
    scene = next(scene for scene in scenes if len(shown_people(scene)) == 1)
    bent = replace(scene.camera, distortion_model='plumb_bob', d=np.array([-0.2, 0.05, 0, 0, 0]))
    frame = RgbdFrame(
        np.zeros((*scene.depth_m.shape, 3), np.uint8), scene.depth_m, bent)
    (person,) = detections(scene)
    moved = undistort_detection(person, frame.camera)
    assert moved.person_mask is not None
    shown = moved.person_mask & np.isfinite(undistort_frame(frame).depth_m)
    assert shown.sum() > 0.8 * moved.person_mask.sum()
    np.testing.assert_array_equal(moved.part_labels >= 0, moved.person_mask)
