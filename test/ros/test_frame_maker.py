"""Depth in a frame of its own is registered with a known transform, and never without one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from geometry_msgs.msg import Transform, TransformStamped
from scipy.spatial.transform import Rotation
from support.messages import camera_info, image

from pop_core.config import PipelineConfig
from pop_core.errors import SettingError
from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import invert_transform, make_transform
from pop_ros.fitting import Nobody
from pop_ros.frame_fitter import FrameFitter
from pop_ros.frame_maker import FrameMaker
from pop_ros.message_error import BadMessageError
from pop_ros.node_config import DepthConfig, InputConfig, NodeConfig
from pop_ros.static_frames import StaticFrames, parse_extrinsics

COLOR = Camera(80, 60, 70.0, 70.0, 39.5, 29.5)
DEPTH = Camera(64, 48, 50.0, 50.0, 31.5, 23.5)


def some_transform(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return make_transform(
        Rotation.from_rotvec(rng.normal(0, 0.5, 3)).as_matrix(), rng.normal(0, 0.3, 3))


def messages(depth_frame: str = 'depth') -> tuple:
    rgb = np.random.default_rng(0).integers(0, 256, (60, 80, 3), dtype=np.uint8)
    far = np.full((48, 64), 2.0, np.float32)
    return (image(rgb, 'rgb8', 77, frame_id='color'),
            image(far, '32FC1', 70, frame_id=depth_frame), camera_info(COLOR), camera_info(DEPTH))


def test_lookup_is_the_product_along_the_tree_whatever_the_direction() -> None:
    frames = StaticFrames()
    T_base_color, T_base_mount, T_mount_depth = (some_transform(k) for k in range(3))
    frames.add('base', '/color', T_base_color)
    frames.add('base', 'mount', T_base_mount)
    frames.add('/mount', 'depth', T_mount_depth)
    found = frames.lookup('color', 'depth')
    assert found is not None
    expected = invert_transform(T_base_color) @ T_base_mount @ T_mount_depth
    np.testing.assert_allclose(found, expected, atol=1e-12)
    back = frames.lookup('depth', 'color')
    assert back is not None
    np.testing.assert_allclose(back @ found, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(frames.lookup('color', 'color'), np.eye(4), atol=1e-12)
    assert frames.lookup('color', 'elsewhere') is None


def test_a_loop_of_frames_ends() -> None:
    frames = StaticFrames()
    frames.add('a', 'b', np.eye(4))
    frames.add('b', 'a', np.eye(4))
    assert frames.lookup('a', 'c') is None


def test_transforms_of_messages_are_those_of_tf() -> None:
    frames = StaticFrames()
    T = some_transform(5)
    x, y, z, w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
    stamped = TransformStamped(child_frame_id='depth', transform=Transform())
    stamped.header.frame_id = 'color'
    t, q = stamped.transform.translation, stamped.transform.rotation
    t.x, t.y, t.z = T[:3, 3].tolist()
    q.x, q.y, q.z, q.w = x, y, z, w

    class TFMessage:
        transforms = (stamped,)

    frames.add_message(TFMessage())
    np.testing.assert_allclose(frames.lookup('color', 'depth'), T, atol=1e-12)


@pytest.mark.parametrize('field', ['x', 'w'])
@pytest.mark.parametrize('number', [0.0, np.nan, np.inf])
def test_a_transform_that_is_none_is_named_and_the_others_are_taken(
    field: str, number: float
) -> None:
    bad, good = TransformStamped(child_frame_id='bad'), TransformStamped(child_frame_id='good')
    setattr(bad.transform.rotation, field, number)
    frames, is_bad = StaticFrames(), not (field == 'x' and number == 0.0)
    told = frames.add_message(SimpleNamespace(transforms=[bad, good]))
    assert [('bad' in text, 'unit quaternion' in text) for text in told] == [(True, True)] * is_bad
    assert (frames.lookup('', 'bad') is None) == is_bad
    assert frames.lookup('', 'good') is not None


@pytest.mark.parametrize('source', ['tf', 'parameter'])
def test_depth_of_another_camera_lands_on_the_colour_image(source: str) -> None:
    frames = StaticFrames()
    maker = FrameMaker(frames)
    if source == 'tf':
        frames.add('color', 'depth', make_transform(np.eye(3), np.array([0.1, 0.0, 0.05])))
    else:
        maker.extrinsics = parse_extrinsics('0.1 0 0.05 0 0 0 1')
    color, depth, info, depth_info = messages()
    frame = maker.make(color, depth, info, depth_info)
    assert frame.stamp_ns == 77
    assert frame.depth_m.shape == (60, 80)
    assert frame.depth_m[30, 40] == pytest.approx(2.05, abs=1e-5)
    # The depth camera's left edge stands 0.1 m to the right of where its rays begin.
    u_edge = COLOR.project(np.array([[-31.5 / 50 * 2 + 0.1, 0.0, 2.05]]))[0, 0]
    columns = np.flatnonzero(np.isfinite(frame.depth_m[30]))
    assert abs(columns[0] - u_edge) <= 1


@pytest.mark.parametrize('missing', ['transform', 'depth/camera_info'])
def test_what_registration_lacks_is_named(missing: str) -> None:
    maker = FrameMaker(StaticFrames())
    color, depth, info, depth_info = messages()
    if missing != 'transform':
        maker.extrinsics = np.eye(4)
    with pytest.raises(BadMessageError, match=missing):
        maker.make(color, depth, info, depth_info if missing == 'transform' else None)


def test_depth_that_does_not_fit_its_camera_is_named() -> None:
    maker = FrameMaker(StaticFrames())
    maker.extrinsics = np.eye(4)
    color, depth, info, _ = messages()
    with pytest.raises(BadMessageError, match='expected 80x60'):
        maker.make(color, depth, info, camera_info(COLOR))


def test_depth_in_the_colour_frame_is_taken_as_registered() -> None:
    maker = FrameMaker(StaticFrames())
    maker.extrinsics = some_transform(1)
    color, _, info, _ = messages()
    depth = image(np.full((60, 80), 1.5, np.float32), '32FC1', frame_id='color')
    assert np.all(maker.make(color, depth, info).depth_m == 1.5)


@pytest.mark.parametrize('text', ['1 2 3', 'a b c d e f g', '0 0 0 0 0 0 0', '0 0 nan 0 0 0 1'])
def test_bad_extrinsics_are_refused(text: str) -> None:
    with pytest.raises(SettingError, match='x y z qx qy qz qw'):
        NodeConfig(depth=DepthConfig(extrinsics=text))


def test_no_extrinsics_are_none() -> None:
    assert parse_extrinsics(' ') is None


def test_the_node_s_setting_says_whether_images_are_rectified() -> None:
    bent = replace(COLOR, distortion_model='plumb_bob', d=np.array([0.1, -0.2, 0.0, 0.0, 0.0]))
    P = np.array([[70.0, 0, 39, 0], [0, 71.0, 29, 0], [0, 0, 1, 0]])
    color, *_ = messages()
    depth = image(np.full((60, 80), 2.0, np.float32), '32FC1', 77, frame_id='color')
    for is_rectified in (True, False):
        config = NodeConfig(input=InputConfig(rectified=is_rectified))
        fitter = FrameFitter(Nobody(), PipelineConfig(), NodeConfig())
        fitter.configure(PipelineConfig(), config)
        camera = fitter._maker.make(color, depth, camera_info(bent, p=P.ravel())).camera
        assert camera.is_distorted != is_rectified
        assert camera.fx == (70.0 if is_rectified else COLOR.fx)


def test_the_node_s_setting_says_how_the_camera_is_mounted() -> None:
    color, *_ = messages()
    depth = image(np.full((60, 80), 2.0, np.float32), '32FC1', 77, frame_id='color')
    fitter = FrameFitter(Nobody(), PipelineConfig(), NodeConfig())
    fitter.configure(PipelineConfig(), NodeConfig(input=InputConfig(quarter_turns=3)))
    assert fitter._maker.make(color, depth, camera_info(COLOR)).camera.quarter_turns == 3
