"""Decode sensor_msgs/CompressedImage of image_transport: JPEG and PNG colour, compressedDepth.

compressedDepth data starts with 12 bytes: an unused int32 and two float32 A and B. 16UC1 is stored
as it is (PNG or RVL); 32FC1 as quantised inverse depth, depth = A / (raw - B).
"""

from __future__ import annotations

import struct
from typing import Any, Protocol

import cv2
import numpy as np
from jaxtyping import Float32, UInt8, UInt16

from pop_core.rgbd import clean_depth
from pop_ros.message_error import BadMessageError
from pop_ros.rvl_kernels import decode_rvl

HEADER = struct.Struct('<iff')
RVL_SIZE = struct.Struct('<ii')
PNG_MAGIC = b'\x89PNG'
MAX_PIXELS = 64_000_000  # more is a damaged header, not a camera


class CompressedLike(Protocol):
    """The fields of sensor_msgs/CompressedImage."""

    header: Any
    format: str
    data: Any


def is_compressed(message: Any) -> bool:
    """Return whether a message is a CompressedImage."""
    return hasattr(message, 'format')


def is_compressed_depth(message: CompressedLike) -> bool:
    """Return whether a CompressedImage holds depth that can be decoded."""
    return 'compressedDepth' in message.format


def decode_compressed_color(message: CompressedLike) -> UInt8[np.ndarray, 'h w 3']:
    """Return the RGB image of a JPEG or PNG message.

    Raises:
        BadMessageError: If it is depth, or cannot be decoded.
    """
    if is_compressed_depth(message):
        raise BadMessageError(
            f'color image: expected a colour image, found format {message.format!r}: is a depth '
            'topic remapped to color/image?')
    image = _decoded(message.data, cv2.IMREAD_COLOR)
    if image is None:
        raise BadMessageError(
            f'color image: expected a JPEG or PNG, found {len(message.data)} bytes of format '
            f'{message.format!r} that are none')
    # Transports convert to bgr8 before they encode, as OpenCV expects, and say so.
    if message.format.endswith('compressed rgb8'):
        return np.asarray(image)
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)


def decode_compressed_depth(message: CompressedLike) -> Float32[np.ndarray, 'h w']:
    """Return the depth [m] of a compressedDepth message, NaN where nothing was measured.

    Raises:
        BadMessageError: If it is not compressedDepth, or cannot be decoded.
    """
    data = bytes(message.data)
    if not is_compressed_depth(message):
        if data.startswith(PNG_MAGIC) and message.format.startswith(('16UC1', 'mono16')):
            return _metres(_raw_depth(data, message.format))
        raise BadMessageError(
            f'depth image: expected the compressedDepth transport, found format '
            f'{message.format!r}: JPEG destroys depth')
    if len(data) <= HEADER.size:
        raise BadMessageError(
            f'depth image: expected compressedDepth with a header of {HEADER.size} bytes, found '
            f'{len(data)} bytes')
    _, a, b = HEADER.unpack_from(data)
    raw = _raw_depth(data[HEADER.size:], message.format)
    if not message.format.startswith('32FC1'):
        return _metres(raw)
    with np.errstate(divide='ignore', invalid='ignore'):
        depth_m = np.float32(a) / (raw.astype(np.float32) - np.float32(b))
    return clean_depth(np.where(raw == 0, np.float32(np.nan), depth_m).astype(np.float32))


def _decoded(data: Any, flags: int) -> np.ndarray | None:
    """Return the pixels of a PNG or JPEG; None for data that is neither, or is damaged."""
    try:
        return cv2.imdecode(np.frombuffer(data, dtype=np.uint8), flags)
    except cv2.error:  # no data at all, or a size that OpenCV refuses
        return None


def _metres(raw: UInt16[np.ndarray, 'h w']) -> Float32[np.ndarray, 'h w']:
    return clean_depth(raw.astype(np.float32) * np.float32(0.001))


def _raw_depth(payload: bytes, name: str) -> UInt16[np.ndarray, 'h w']:
    if payload.startswith(PNG_MAGIC):
        raw = _decoded(payload, cv2.IMREAD_UNCHANGED)
        if raw is not None and raw.dtype == np.uint16 and raw.ndim == 2:
            return np.asarray(raw)
    elif 'rvl' in name.lower() and len(payload) > RVL_SIZE.size:
        return _rvl_depth(payload)
    raise BadMessageError(
        f'depth image: expected a 16-bit PNG or RVL, found format {name!r} with data that is '
        'neither')


def _rvl_depth(payload: bytes) -> UInt16[np.ndarray, 'h w']:
    width, height = RVL_SIZE.unpack_from(payload)
    if not (width > 0 and height > 0 and width * height <= MAX_PIXELS):
        raise BadMessageError(f'depth image: expected an image size, found {width}x{height}')
    words = np.frombuffer(payload[RVL_SIZE.size:], dtype='<u4', count=(len(payload) - 8) // 4)
    # Words of 32 bits are filled from their high nibble down.
    shifts = np.arange(28, -1, -4, dtype=np.uint32)
    nibbles = ((words[:, None] >> shifts) & 15).astype(np.uint8).ravel()
    depth = np.zeros(width * height, dtype=np.uint16)
    written = decode_rvl(nibbles, depth)
    if written < depth.size:
        raise BadMessageError(
            f'depth image: expected {depth.size} pixels of RVL, found {written}')
    return depth.reshape(height, width)
