from dataclasses import replace

import numpy as np

from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.rgbd import RgbdFrame, distort_mask, undistort_frame, undistort_mask

CAMERA = Camera(320, 240, 260.0, 260.0, 159.5, 119.5, 'plumb_bob',
                np.array([-0.2, 0.05, 0.001, -0.001, 0.0]))


def test_undistorted_keypoints_lie_where_a_pinhole_sees_the_point() -> None:
    p = np.column_stack([np.linspace(-0.8, 0.8, 15), np.linspace(0.5, -0.5, 15), np.full(15, 2.0)])
    uv = CAMERA.project(p)
    uv[3] = np.nan
    seen = Detection(uv, np.ones(15), np.array([10.0, 10.0, 300.0, 230.0]))
    moved = undistort_detection(seen, CAMERA).keypoints_px
    expected = CAMERA.without_distortion().project(p)
    expected[3] = np.nan
    np.testing.assert_allclose(moved, expected, atol=1e-3)


def test_a_mask_comes_back_to_the_pixels_it_was_seen_in() -> None:
    depth = np.full((240, 320), 3.0, dtype=np.float32)
    depth[80:160, 40:120] = 1.0
    frame = RgbdFrame(np.zeros((240, 320, 3), dtype=np.uint8), depth, CAMERA)
    pinhole = undistort_frame(frame)
    assert not pinhole.camera.is_distorted
    returned = distort_mask(pinhole.depth_m == 1.0, CAMERA)
    different = returned != (depth == 1.0)
    # Nearest neighbours twice: at most the rim changes.
    assert different.sum() < 2 * (80 + 80)


def test_a_mask_of_a_distorted_image_moves_to_where_the_pinhole_sees_it() -> None:
    camera = Camera(160, 120, 130.0, 130.0, 79.5, 59.5, 'plumb_bob',
                    np.array([-0.3, 0.1, 0.0, 0.0, 0.0]))
    point = np.array([[0.7, 0.5, 2.0]])
    u, v = np.rint(camera.project(point)[0]).astype(int)
    mask = np.zeros((120, 160), dtype=bool)
    mask[v - 2: v + 3, u - 2: u + 3] = True
    rows, columns = np.nonzero(undistort_mask(mask, camera))
    expected = camera.without_distortion().project(point)[0]
    assert np.linalg.norm(expected - [u, v]) > 2.5  # the test would be empty otherwise
    # half a pixel of rounding on either side, and what the block is stretched by
    np.testing.assert_allclose([columns.mean(), rows.mean()], expected, atol=1.2)


def test_mask_and_parts_move_with_the_keypoints() -> None:
    labels = np.full((240, 320), -1, dtype=np.int8)
    labels[32:49, 32:49], labels[150:220, 230:300] = 7, 0
    corner = np.full((15, 2), 40.0)
    seen = Detection(corner, np.ones(15), np.array([32.0, 32.0, 48.0, 48.0]),
                     person_mask=labels >= 0, part_labels=labels)
    moved = undistort_detection(seen, CAMERA)
    assert moved.person_mask is not None
    assert moved.part_labels is not None
    assert (moved.person_mask.dtype, moved.part_labels.dtype) == (bool, np.int8)
    np.testing.assert_array_equal(moved.part_labels >= 0, moved.person_mask)
    assert set(np.unique(moved.part_labels)) == {-1, 0, 7}
    u, v = np.rint(moved.keypoints_px[0]).astype(int)
    rows, columns = np.nonzero(moved.part_labels == 7)
    assert np.linalg.norm([u - 40, v - 40]) > 3.0  # the test would be empty otherwise
    np.testing.assert_allclose([columns.mean(), rows.mean()], [u, v], atol=1.5)


def test_cameras_keep_their_own_maps() -> None:
    other = replace(CAMERA, cx=150.0)
    mask = np.zeros((240, 320), dtype=bool)
    mask[10:40, 10:40] = True
    first = undistort_mask(mask, CAMERA)
    assert (undistort_mask(mask, other) != first).any()
    np.testing.assert_array_equal(undistort_mask(mask, replace(CAMERA)), first)


def test_a_pinhole_needs_nothing() -> None:
    plain = CAMERA.without_distortion()
    depth = np.full((240, 320), 2.0, dtype=np.float32)
    frame = RgbdFrame(np.zeros((240, 320, 3), dtype=np.uint8), depth, plain)
    assert undistort_frame(frame) is frame
    mask = depth > 1.0
    assert undistort_mask(mask, plain) is mask
