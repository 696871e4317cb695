import numpy as np

from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.rgbd import RgbdFrame, distort_mask, undistort_frame

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


def test_a_pinhole_needs_nothing() -> None:
    plain = CAMERA.without_distortion()
    depth = np.full((240, 320), 2.0, dtype=np.float32)
    frame = RgbdFrame(np.zeros((240, 320, 3), dtype=np.uint8), depth, plain)
    assert undistort_frame(frame) is frame
