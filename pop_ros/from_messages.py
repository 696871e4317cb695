"""Turn sensor_msgs images and camera infos into arrays and an RgbdFrame.

Units come from the encoding, never from a setting (REP 118): 16UC1 and mono16 are millimetres with
0 for no measurement, 32FC1 is metres with NaN or infinity. Messages are anything with the fields
of ROS: those of rclpy and those that rosbags reads from bags.
"""

from __future__ import annotations

from typing import Any, Protocol

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from pop_core.errors import CameraError
from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame, clean_depth
from pop_ros.compressed import decode_compressed_color, decode_compressed_depth, is_compressed
from pop_ros.message_error import BadMessageError

COLOR_CHANNELS = {'rgb8': 3, 'bgr8': 3, 'rgba8': 4, 'bgra8': 4, 'mono8': 1, '8UC1': 1, '8UC3': 3}
DEPTH_TYPES = {'16UC1': 'u2', 'mono16': 'u2', '32FC1': 'f4'}
# Of depth in millimetres, 0 where nothing was measured (REP 118).
METRES = np.arange(2**16, dtype=np.float32) * np.float32(0.001)
METRES[0] = np.nan
TO_RGB = {
    'bgr8': cv2.COLOR_BGR2RGB, '8UC3': cv2.COLOR_BGR2RGB, 'rgba8': cv2.COLOR_RGBA2RGB,
    'bgra8': cv2.COLOR_BGRA2RGB, 'mono8': cv2.COLOR_GRAY2RGB, '8UC1': cv2.COLOR_GRAY2RGB,
}
NO_DISTORTION = ('', 'none', 'None')
MODEL_ALIASES = {'fisheye': 'equidistant', 'kannala_brandt4': 'equidistant'}


class ImageLike(Protocol):
    """The fields of sensor_msgs/Image."""

    header: Any
    height: int
    width: int
    encoding: str
    is_bigendian: Any
    step: int
    data: Any


def stamp_ns(header: Any) -> int:
    """Return the stamp of a std_msgs/Header [ns]."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def decode_color(message: Any) -> UInt8[np.ndarray, 'h w 3']:
    """Return the RGB image of an Image or CompressedImage.

    Raises:
        BadMessageError: If the encoding is not 8-bit colour or grey, or data is missing.
    """
    if is_compressed(message):
        return decode_compressed_color(message)
    channels = COLOR_CHANNELS.get(message.encoding)
    if channels is None:
        raise BadMessageError(
            f'color image: expected encoding {", ".join(COLOR_CHANNELS)}, found '
            f'{message.encoding!r}{_color_advice(message.encoding)}')
    rows = _rows(message, channels, 'color image')
    image = rows.reshape(message.height, message.width, channels)
    code = TO_RGB.get(message.encoding)
    # A copy where no conversion makes one: the message's memory belongs to the middleware.
    return np.array(image) if code is None else cv2.cvtColor(np.ascontiguousarray(image), code)


def decode_depth(message: Any) -> Float32[np.ndarray, 'h w']:
    """Return the depth [m] of an Image or CompressedImage, NaN where nothing was measured.

    Raises:
        BadMessageError: If the encoding is not one of REP 118, or data is missing.
    """
    if is_compressed(message):
        return decode_compressed_depth(message)
    kind = DEPTH_TYPES.get(message.encoding)
    if kind is None:
        raise BadMessageError(
            f'depth image: expected encoding {", ".join(DEPTH_TYPES)} (REP 118), found '
            f'{message.encoding!r}: is a colour or disparity image remapped to depth/image?')
    dtype = np.dtype(kind).newbyteorder('>' if message.is_bigendian else '<')
    rows = _rows(message, dtype.itemsize, 'depth image')
    raw = np.ascontiguousarray(rows).view(dtype)
    return METRES[raw] if kind == 'u2' else clean_depth(raw.astype(np.float32))


def camera_from_info(info: Any, *, is_rectified: bool = False) -> Camera:
    """Return the intrinsics of a CameraInfo, of ROS 2 or ROS 1, after its binning and ROI.

    Args:
        info: The message.
        is_rectified: Whether its images come with distortion taken out: P holds then.

    Raises:
        BadMessageError: If the camera is uncalibrated or its distortion model is unknown.
    """
    K = np.asarray(_field(info, 'k'), dtype=np.float64)
    if K[0] == 0:
        raise BadMessageError(
            'camera_info: expected intrinsics, found K = 0: the camera is uncalibrated '
            '(run camera_calibration, or let the driver publish its factory calibration)')
    model, d = _distortion(info)
    if is_rectified:
        P = np.asarray(_field(info, 'p'), dtype=np.float64).reshape(3, 4)
        K, model, d = P[:, :3].ravel(), '', np.zeros(0)
    bin_x, bin_y = max(1, int(info.binning_x)), max(1, int(info.binning_y))
    roi = info.roi
    width, height = int(roi.width) or int(info.width), int(roi.height) or int(info.height)
    try:
        return Camera(
            width // bin_x, height // bin_y, K[0] / bin_x, K[4] / bin_y,
            (K[2] - roi.x_offset + 0.5) / bin_x - 0.5, (K[5] - roi.y_offset + 0.5) / bin_y - 0.5,
            model, d)
    except CameraError as error:
        raise BadMessageError(f'camera_info: {error}') from error


def frame_from_messages(
    color: Any, depth: Any, info: Any, *, is_rectified: bool = False
) -> RgbdFrame:
    """Return the frame of a pair of registered images and their CameraInfo.

    Args:
        color: Colour image.
        depth: Depth image.
        info: CameraInfo of both.
        is_rectified: Whether distortion has been taken out of the images.

    Raises:
        BadMessageError: If one of the three cannot be read or they do not belong together.
    """
    camera = camera_from_info(info, is_rectified=is_rectified)
    if depth.header.frame_id != color.header.frame_id:
        raise BadMessageError(
            f'pair: expected depth registered to color frame {color.header.frame_id!r}, found '
            f'depth in frame {depth.header.frame_id!r}: switch on depth registration '
            '(align_depth, depth_registered) in the driver')
    rgb, depth_m = decode_color(color), decode_depth(depth)
    sizes = {'color image': rgb.shape[1::-1], 'depth image': depth_m.shape[::-1],
             'camera_info': (camera.width, camera.height)}
    if len(set(sizes.values())) > 1:
        found = ', '.join(f'{name} {w}x{h}' for name, (w, h) in sizes.items())
        raise BadMessageError(
            f'pair: expected one size for color, depth and camera_info, found {found}: '
            'use the depth that the driver registers (aligns) to color, and the color camera_info')
    return RgbdFrame(rgb, depth_m, camera, stamp_ns(color.header))


def _rows(message: ImageLike, bytes_per_pixel: int, name: str) -> UInt8[np.ndarray, 'h b']:
    """Return the used bytes of each row: `step` may be larger than the width."""
    height, step, used = message.height, message.step, message.width * bytes_per_pixel
    data = np.frombuffer(message.data, dtype=np.uint8)
    if height <= 0 or used <= 0 or step < used or data.size < step * (height - 1) + used:
        raise BadMessageError(
            f'{name}: expected {height} rows of at least {used} bytes '
            f'({message.width}x{height} {message.encoding}), found step {step} and '
            f'{data.size} bytes')
    # The last row may lack its padding.
    return np.lib.stride_tricks.as_strided(data, (height, used), (step, 1), writeable=False)


def _distortion(info: Any) -> tuple[str, np.ndarray]:
    d = np.asarray(_field(info, 'd'), dtype=np.float64)
    if info.distortion_model in NO_DISTORTION or not np.any(d):
        return '', np.zeros(0)
    return MODEL_ALIASES.get(info.distortion_model, info.distortion_model), d


def _field(info: Any, name: str) -> Any:
    """Return a field whose name is lower case in ROS 2 and upper case in ROS 1."""
    return getattr(info, name) if hasattr(info, name) else getattr(info, name.upper())


def _color_advice(encoding: str) -> str:
    if encoding.startswith('bayer'):
        return ': debayer it first (image_proc)'
    if encoding in DEPTH_TYPES:
        return ': is a depth image remapped to color/image?'
    return ''
