"""Topic names of common RGB-D drivers, so that a user names the camera and not three topics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pop_core.errors import PopError
from pop_ros.bag_topics import RgbdTopics


class CameraPresetError(PopError):
    """A camera that has no preset."""


@dataclass(frozen=True, slots=True)
class CameraPreset:
    """The topics of one driver.

    Args:
        topics: Colour, depth registered to it, and CameraInfo of colour.
        driver: Driver the names are those of.
        hint: What to switch on in the driver so that depth is registered to colour.
    """

    topics: RgbdTopics
    driver: str
    hint: str


def _below(prefix: str, color: str, depth: str, info: str) -> RgbdTopics:
    return RgbdTopics(f'{prefix}/{color}', f'{prefix}/{depth}', f'{prefix}/{info}')


CAMERA_PRESETS: Mapping[str, CameraPreset] = {
    'realsense': CameraPreset(
        _below('/camera/camera', 'color/image_raw', 'aligned_depth_to_color/image_raw',
               'color/camera_info'),
        'realsense2_camera', 'align_depth.enable:=true enable_sync:=true'),
    'azure_kinect': CameraPreset(
        _below('', 'rgb/image_raw', 'depth_to_rgb/image_raw', 'rgb/camera_info'),
        'azure_kinect_ros_driver', 'depth_enabled:=true color_enabled:=true'),
    'orbbec': CameraPreset(
        _below('/camera', 'color/image_raw', 'depth/image_raw', 'color/camera_info'),
        'orbbec_camera', 'depth_registration:=true enable_frame_sync:=true'),
    'zed': CameraPreset(
        _below('/zed/zed_node', 'rgb/color/rect/image', 'depth/depth_registered',
               'rgb/color/rect/camera_info'),
        'zed_wrapper 5', 'nothing: depth is registered'),
    'zed4': CameraPreset(
        _below('/zed/zed_node', 'rgb/image_rect_color', 'depth/depth_registered',
               'rgb/camera_info'),
        'zed_wrapper 4', 'nothing: depth is registered'),
    'oak': CameraPreset(
        _below('/oak', 'rgb/image_raw', 'stereo/image_raw', 'rgb/camera_info'),
        'depthai_ros_driver', 'stereo.i_align_depth: true'),
    'openni': CameraPreset(
        _below('/camera', 'rgb/image_raw', 'depth_registered/image_raw', 'rgb/camera_info'),
        'openni2_camera', 'depth_registration:=true'),
}


def camera_preset(name: str) -> CameraPreset:
    """Return the preset of a camera.

    Raises:
        CameraPresetError: If there is none.
    """
    if name not in CAMERA_PRESETS:
        raise CameraPresetError(
            f'camera: expected one of {", ".join(CAMERA_PRESETS)}, found {name!r}')
    return CAMERA_PRESETS[name]
