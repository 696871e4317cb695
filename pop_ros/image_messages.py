"""Turn images and cameras into sensor_msgs, as a camera driver publishes them."""

from __future__ import annotations

import array

import numpy as np
from jaxtyping import Float32, UInt16
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from pop_core.geometry.camera import Camera


def color_message(rgb: np.ndarray, header: Header) -> Image:
    """Return an rgb8 image."""
    return _image(rgb, 'rgb8', header)


def depth_message(depth_m: np.ndarray, header: Header) -> Image:
    """Return a 16UC1 image in millimetres, 0 where nothing was measured (REP 118)."""
    return _image(depth_mm(depth_m), '16UC1', header)


def depth_mm(depth_m: Float32[np.ndarray, 'h w']) -> UInt16[np.ndarray, 'h w']:
    """Return depth as 16UC1 stores it: whole millimetres, 0 where nothing was measured."""
    millimetres = np.nan_to_num(np.rint(depth_m * 1000), nan=0.0)
    return np.clip(millimetres, 0, 65535).astype('<u2')


def info_message(camera: Camera, header: Header) -> CameraInfo:
    """Return the CameraInfo of a camera whose images are not rectified."""
    K = camera.K
    d = camera.d if camera.d.size else np.zeros(5)
    return CameraInfo(
        header=header, width=camera.width, height=camera.height,
        distortion_model=camera.distortion_model or 'plumb_bob', d=d.tolist(),
        k=K.ravel().tolist(), r=np.eye(3).ravel().tolist(),
        p=np.column_stack([K, np.zeros(3)]).ravel().tolist())


def _image(pixels: np.ndarray, encoding: str, header: Header) -> Image:
    data = array.array('B')
    data.frombytes(np.ascontiguousarray(pixels).tobytes())
    height, width = pixels.shape[:2]
    return Image(
        header=header, height=height, width=width, encoding=encoding, is_bigendian=0,
        step=len(data) // height, data=data)
