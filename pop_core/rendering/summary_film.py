"""Write pictures as a film: .mp4 for players, .webp and .gif for web pages."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

import cv2
import numpy as np
from jaxtyping import UInt8

from pop_core.errors import PopError

SUFFIXES = ('.mp4', '.webp', '.gif')
QUALITY = 60  # of WebP, 0..100: text stays readable


class FilmError(PopError):
    """A film that cannot be written here."""


class SummaryFilm:
    """A film that grows picture by picture; all are scaled to the size of the first."""

    def __init__(self, path: Path, rate_hz: float, width: int = 960) -> None:
        """Name a film; it is written on leaving the `with` block.

        Args:
            path: File to write; its suffix is the format.
            rate_hz: Pictures per second.
            width: Width of the film [px]; smaller pictures keep theirs.

        Raises:
            FilmError: If the suffix names no format.
        """
        if path.suffix not in SUFFIXES:
            raise FilmError(f'{path}: expected a film of {", ".join(SUFFIXES)}, found another')
        self._path, self._rate_hz, self._width = path, rate_hz, width
        self._size: tuple[int, int] | None = None
        self._video: cv2.VideoWriter | None = None
        self._pictures: list[UInt8[np.ndarray, 'h w 3']] = []

    def __enter__(self) -> SummaryFilm:
        """Return the film."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Finish the file; without any picture there is none."""
        if self._video is not None:
            self._video.release()
        if self._pictures and error is None:
            self._write_animation()

    def add(self, rgb: UInt8[np.ndarray, 'h w 3']) -> None:
        """Append a picture.

        Raises:
            FilmError: If this build of OpenCV has no encoder for the format.
        """
        if self._size is None:
            self._size = _even_size(rgb, self._width)
            if self._path.suffix == '.mp4':
                self._video = self._open_video(self._size)
        small = cv2.resize(rgb, self._size, interpolation=cv2.INTER_AREA)
        bgr = cv2.cvtColor(small, cv2.COLOR_RGB2BGR)
        if self._video is not None:
            self._video.write(bgr)
        else:
            self._pictures.append(bgr)

    def _open_video(self, size: tuple[int, int]) -> cv2.VideoWriter:
        # MPEG-4 part 2: the one encoder for .mp4 that OpenCV's wheels carry.
        code = cv2.VideoWriter.fourcc(*'mp4v')
        video = cv2.VideoWriter(str(self._path), code, self._rate_hz, size)
        if not video.isOpened():
            raise FilmError(
                f'{self._path}: expected an OpenCV that writes MPEG-4, found one that does not: '
                'name a film that ends in .webp')
        return video

    def _write_animation(self) -> None:
        if not hasattr(cv2, 'imwriteanimation'):
            raise FilmError(
                f'{self._path}: expected OpenCV 4.11 or newer for animations, found '
                f'{cv2.__version__}: name a film that ends in .mp4')
        animation = cv2.Animation()
        animation.frames = self._pictures
        animation.durations = [round(1000 / self._rate_hz)] * len(self._pictures)
        settings = [cv2.IMWRITE_WEBP_QUALITY, QUALITY] if self._path.suffix == '.webp' else []
        if not cv2.imwriteanimation(str(self._path), animation, settings):
            raise FilmError(f'{self._path}: expected a film to be written, found no encoder')


def _even_size(rgb: UInt8[np.ndarray, 'h w 3'], width: int) -> tuple[int, int]:
    """Return the size of the film: video encoders want even numbers."""
    height, found = rgb.shape[:2]
    scale = min(1.0, width / found)
    return 2 * max(1, round(found * scale / 2)), 2 * max(1, round(height * scale / 2))
