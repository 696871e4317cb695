import numpy as np
import pytest

from pop_core.geometry.transform import transform_points
from pop_core.synthesis.cameras import CameraRange, draw_camera, look_at


def test_the_point_looked_at_lies_on_the_optical_axis():
    aim = np.array([0.4, 1.0, -0.3])
    T_camera_room = look_at(np.array([1.0, 1.6, 3.0]), aim, 0.2)
    seen = transform_points(T_camera_room, aim[None])[0]
    assert seen[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert seen[2] == pytest.approx(np.linalg.norm(aim - [1.0, 1.6, 3.0]))


def test_up_in_the_room_is_up_in_the_image_and_left_of_a_facing_person_is_right():
    T_camera_room = look_at(np.array([0.0, 1.5, 3.0]), np.array([0.0, 1.5, 0.0]))
    R = T_camera_room[:3, :3]
    up, left = R[:, 1], R[:, 0]
    assert up == pytest.approx([0.0, -1.0, 0.0])
    assert left == pytest.approx([1.0, 0.0, 0.0])
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_drawn_cameras_stand_within_their_range():
    ranges = CameraRange(distance_m=(2.0, 2.5), height_m=(1.0, 1.2), aim_m=0.0)
    rng = np.random.default_rng(0)
    for _ in range(20):
        camera, T_camera_room = draw_camera(np.array([0.0, 0.9, 0.5]), ranges, rng)
        eye = -T_camera_room[:3, :3].T @ T_camera_room[:3, 3]
        assert 1.0 <= eye[1] <= 1.2
        assert 2.5 <= eye[2] <= 3.0
        assert 0.75 * 640 <= camera.fx <= 1.05 * 640
