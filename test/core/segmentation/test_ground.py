from dataclasses import replace

import numpy as np
import pytest
from support.mounted import mounted, turned_points

from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.ground import Ground, find_ground, ground_of
from pop_core.segmentation.plane_kernels import plane_shares

CAMERA = Camera(320, 240, 262.0, 262.0, 159.5, 119.5)


def room(pitch_rad: float, roll_rad: float, height_m: float, noise: float) -> tuple:
    """A floor and a wall behind it, seen by a tilted camera; and the true floor."""
    R = from_rotvec(np.array([pitch_rad, 0.0, 0.0])) @ from_rotvec(np.array([0, 0, roll_rad]))
    normal = R @ np.array([0.0, -1.0, 0.0])
    rays = np.dstack([CAMERA.ray_grid(), np.ones((240, 320))])
    along = rays @ normal
    floor_m = np.where(along < 0, -height_m / np.minimum(along, -1e-9), np.inf)
    depth = np.minimum(floor_m, 5.0)
    rng = np.random.default_rng(0)
    depth = depth + noise * rng.normal(size=depth.shape) * depth**2
    return depth.astype(np.float32), Ground(normal, height_m)


def frame(depth: np.ndarray) -> RgbdFrame:
    return RgbdFrame(np.zeros((240, 320, 3), dtype=np.uint8), depth, CAMERA)


@pytest.mark.parametrize(('pitch', 'roll', 'height'), [(0.0, 0.0, 1.2), (0.5, 0.1, 1.8),
                                                       (0.3, -0.2, 0.6)])
def test_the_floor_of_a_tilted_camera_is_found(pitch: float, roll: float, height: float) -> None:
    depth, truth = room(pitch, roll, height, noise=0.002)
    found = find_ground(frame(depth))
    assert found is not None
    assert found.offset_m == pytest.approx(height, abs=0.02)  # sensor noise at 5 m is 5 cm
    assert np.degrees(np.arccos(found.normal @ truth.normal)) < 1.0


@pytest.mark.parametrize('turns', [1, 2, 3])
def test_a_camera_on_its_side_or_upside_down_finds_the_floor_too(turns: int) -> None:
    depth, truth = room(0.3, 0.0, 1.5, noise=0.002)
    seen = mounted(frame(depth), turns)
    found = find_ground(seen)
    assert found is not None
    assert found.offset_m == pytest.approx(1.5, abs=0.02)
    normal, = turned_points(found.normal[None], turns)
    assert np.degrees(np.arccos(normal @ truth.normal)) < 1.0
    forgotten = replace(seen, camera=replace(seen.camera, quarter_turns=0))
    assert find_ground(forgotten) is None


def test_a_table_above_the_floor_is_not_the_floor() -> None:
    depth, _ = room(0.5, 0.0, 1.6, noise=0.0)
    table, _ = room(0.5, 0.0, 0.8, noise=0.0)
    depth[120:, 60:260] = table[120:, 60:260]
    found = find_ground(frame(depth))
    assert found is not None
    assert found.offset_m == pytest.approx(1.6, abs=0.02)


def test_a_seat_with_the_foot_of_a_wall_below_it_is_not_the_floor() -> None:
    seat, _ = room(0.3, 0.0, 0.6, noise=0.0)
    depth = np.where(seat < 2.0, seat, np.float32(5.0))
    assert find_ground(frame(seat)) is not None
    assert find_ground(frame(depth)) is None


def test_a_wall_alone_has_no_floor() -> None:
    assert find_ground(frame(np.full((240, 320), 2.0, dtype=np.float32))) is None


def test_nothing_measured_has_no_floor() -> None:
    assert find_ground(frame(np.full((240, 320), np.nan, dtype=np.float32))) is None


def test_who_is_surely_below_a_plane_does_not_stand_on_it() -> None:
    seat = Ground(np.array([0.0, -1.0, 0.0]), 0.8)
    joints = np.array([[0.0, 0.2, 2.0], [0.0, 1.1, 2.0]])  # 60 cm above it, 30 below
    sure, unsure = np.array([0.03, 0.1]), np.array([0.03, 0.4])
    assert ground_of(seat, joints, sure) is None
    assert ground_of(seat, joints, unsure) is seat
    assert ground_of(seat, joints[:1], sure[:1]) is seat
    assert ground_of(None, joints, sure) is None


def test_floor_pixels_are_those_of_the_floor() -> None:
    depth, truth = room(0.4, 0.0, 1.4, noise=0.0)
    rays = CAMERA.ray_grid()
    marked = truth.floor_pixels(depth, CAMERA)
    assert marked[depth < 5.0].all()
    points = np.dstack([rays * depth[..., None], depth]).reshape(-1, 3)
    high = truth.height(points).reshape(depth.shape) > 0.1  # twice the band at 5 m
    assert high.any()
    assert not marked[high].any()
    raised = np.where(depth < 5.0, depth * 0.9, depth).astype(np.float32)
    assert not truth.floor_pixels(raised, CAMERA)[depth < 5.0].any()


@pytest.mark.filterwarnings('error')
def test_pure_noise_has_no_floor_and_breaks_nothing() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        depth = rng.uniform(0.5, 6.0, (240, 320)).astype(np.float32)
        found = find_ground(frame(depth))
        assert found is None or np.isfinite(found.normal).all()


def test_points_on_and_below_many_planes_are_counted_as_one_by_one() -> None:
    rng = np.random.default_rng(0)
    points, on_plane = rng.normal(size=(400, 3)), rng.normal(size=(7, 3))
    normals = rng.normal(size=(7, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    width = rng.uniform(0.05, 0.5, 400)
    on, below = np.zeros((2, 7))
    plane_shares(np.ascontiguousarray(points.T), width, normals, on_plane, 2.0, on, below)
    height = np.einsum('pc,pnc->pn', normals, points - on_plane[:, None])
    np.testing.assert_allclose(on, (np.abs(height) < width).mean(axis=1))
    np.testing.assert_allclose(below, (height < -2.0 * width).mean(axis=1))
    assert on.min() > 0.0
    assert below.min() > 0.0
