"""Networks see upright people, whatever the camera's mounting; all others see its own pixels."""

from dataclasses import replace

import numpy as np
import pytest
from support.mounted import mounted

from pop_core.geometry.camera import Camera
from pop_core.keypoints.boxes import PersonBox
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.people import detection_of
from pop_core.keypoints.upright import (
    box_turned_back,
    detect_upright,
    turned_back,
    upright_box,
    upright_frame,
)
from pop_core.rgbd import RgbdFrame

CAMERA = Camera(64, 48, 60.0, 58.0, 33.0, 22.0)
TURNS = pytest.mark.parametrize('turns', [1, 2, 3])


@pytest.fixture
def upright() -> RgbdFrame:
    rng = np.random.default_rng(0)
    depth_m = rng.uniform(1.0, 3.0, (48, 64)).astype(np.float32)
    return RgbdFrame(rng.integers(0, 255, (48, 64, 3), dtype=np.uint8), depth_m, CAMERA, 7)


@pytest.fixture
def person() -> Detection:
    rng = np.random.default_rng(1)
    uv = rng.integers([0, 0], [64, 48], (15, 2)).astype(float)
    found = replace(
        detection_of(uv, np.full(15, 0.9)),
        box_px=np.concatenate([uv.min(axis=0), uv.max(axis=0)]))
    labels = rng.integers(-1, 24, (48, 64)).astype(np.int8)
    return replace(found, person_mask=labels >= 0, part_labels=labels)


def test_an_upright_frame_is_itself(upright: RgbdFrame, person: Detection) -> None:
    assert upright_frame(upright) is upright
    assert turned_back(person, CAMERA) is person


@TURNS
def test_networks_get_the_upright_image_and_its_camera(upright: RgbdFrame, turns: int) -> None:
    seen = upright_frame(mounted(upright, turns))
    np.testing.assert_array_equal(seen.rgb, upright.rgb)
    np.testing.assert_array_equal(seen.depth_m, upright.depth_m)
    assert seen.camera.sees_like(CAMERA, 1e-9)
    assert seen.stamp_ns == 7


@TURNS
def test_what_is_found_lies_on_the_same_pixels_of_the_camera_s_own_image(
    upright: RgbdFrame, person: Detection, turns: int
) -> None:
    frame = mounted(upright, turns)
    found, = detect_upright(lambda _seen: [person], frame)
    u, v = found.keypoints_px.astype(int).T
    before_u, before_v = person.keypoints_px.astype(int).T
    np.testing.assert_array_equal(frame.rgb[v, u], upright.rgb[before_v, before_u])
    np.testing.assert_array_equal(
        found.part_labels[v, u], person.part_labels[before_v, before_u])
    np.testing.assert_array_equal(found.person_mask, found.part_labels >= 0)
    np.testing.assert_allclose(found.box_px[:2], found.keypoints_px.min(axis=0))
    np.testing.assert_allclose(found.box_px[2:], found.keypoints_px.max(axis=0))


@TURNS
def test_boxes_come_back_as_they_went(upright: RgbdFrame, turns: int) -> None:
    camera = mounted(upright, turns).camera
    box = PersonBox(np.array([3.0, 5.0, 20.0, 40.0]), 0.5)
    there = upright_box(box, camera)
    np.testing.assert_allclose(box_turned_back(there, camera).box_px, box.box_px)
    assert np.all(there.box_px[:2] < there.box_px[2:])
