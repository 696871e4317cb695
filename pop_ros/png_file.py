"""Read PNG files that may be truncated, damaged or of another kind than expected.

Image libraries decode what is left of a damaged file and warn on the terminal; here the chunks
are checked first, so that half an image is never taken for a whole one.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8, UInt16

from pop_core.errors import FrameError

SIGNATURE = b'\x89PNG\r\n\x1a\n'
COLOR_TYPES = {0: 'gray', 2: 'RGB', 3: 'palette', 4: 'gray and alpha', 6: 'RGBA'}
MAX_PIXELS = 64_000_000


@dataclass(frozen=True, slots=True)
class PngHeader:
    """What the first chunk of a PNG says.

    Args:
        width: Image width [px].
        height: Image height [px].
        bits: Bits per channel.
        kind: One of the values of COLOR_TYPES.
    """

    width: int
    height: int
    bits: int
    kind: str

    def __str__(self) -> str:
        """Return the header as a user would say it."""
        return f'{self.bits}-bit {self.kind} of {self.width}x{self.height}'


def load_rgb_png(path: Path, size: tuple[int, int]) -> UInt8[np.ndarray, 'h w 3']:
    """Return an 8-bit colour image in RGB order.

    Args:
        path: PNG file.
        size: Expected (width, height) [px].

    Raises:
        FrameError: If the file is not a whole 8-bit PNG of this size.
    """
    content, header = _checked(path, size)
    if header.bits > 8:
        raise FrameError(f'{path}: expected an 8-bit colour image, found {header}')
    # A camera's pixels are where its intrinsics say: a rotation tag must not move them.
    flags = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
    bgr = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    if bgr is None:
        raise FrameError(f'{path}: expected a PNG that decodes, found {header} that does not')
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB), dtype=np.uint8)


def load_depth_png(path: Path, size: tuple[int, int]) -> UInt16[np.ndarray, 'h w']:
    """Return a 16-bit depth image in units of its own; 0 is no measurement.

    Args:
        path: PNG file.
        size: Expected (width, height) [px].

    Raises:
        FrameError: If the file is not a whole 16-bit gray PNG of this size.
    """
    content, header = _checked(path, size)
    if header.bits != 16 or header.kind != 'gray':
        raise FrameError(f'{path}: expected depth as 16-bit gray, found {header}')
    flags = cv2.IMREAD_UNCHANGED | cv2.IMREAD_IGNORE_ORIENTATION
    units = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    if units is None:
        raise FrameError(f'{path}: expected a PNG that decodes, found {header} that does not')
    return np.asarray(units, dtype=np.uint16)


def _checked(path: Path, size: tuple[int, int]) -> tuple[bytes, PngHeader]:
    content = path.read_bytes()
    header = check_png(content, path)
    if (header.width, header.height) != size:
        raise FrameError(
            f'{path}: expected {size[0]}x{size[1]} as the camera says, found {header}')
    return content, header


def check_png(content: bytes, path: Path) -> PngHeader:
    """Return the header of a PNG whose every chunk is whole (ISO/IEC 15948, section 5).

    Raises:
        FrameError: If it is not a PNG, is cut short, or a chunk's checksum fails.
    """
    if not content.startswith(SIGNATURE):
        raise FrameError(f'{path}: expected a PNG, found a file that starts {content[:8]!r}')
    header = None
    at = len(SIGNATURE)
    while at + 12 <= len(content):
        length, kind = struct.unpack_from('>I4s', content, at)
        end = at + 12 + length
        if end > len(content):
            break
        data = memoryview(content)[at + 8: end - 4]
        if zlib.crc32(data, zlib.crc32(kind)) != struct.unpack_from('>I', content, end - 4)[0]:
            raise FrameError(
                f'{path}: expected an undamaged PNG, found a wrong checksum at byte {at}')
        if kind == b'IHDR' and length == 13:
            header = _header(data, path)
        if kind == b'IEND' and header is not None:
            return header
        at = end
    raise FrameError(f'{path}: expected a whole PNG, found one cut at byte {len(content)}')


def _header(data: memoryview, path: Path) -> PngHeader:
    width, height, bits, color_type = struct.unpack_from('>IIBB', data)
    if width * height > MAX_PIXELS or color_type not in COLOR_TYPES:
        raise FrameError(
            f'{path}: expected an image of at most {MAX_PIXELS} pixels, found {width}x{height} '
            f'with colour type {color_type}')
    return PngHeader(width, height, bits, COLOR_TYPES[color_type])
