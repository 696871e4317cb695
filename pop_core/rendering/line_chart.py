"""Small charts of lines over steps, drawn with the picture's own tools."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from pop_core.rendering.palette import FAINT, INK, PAPER

MARGIN_LEFT, MARGIN_RIGHT, MARGIN_TOP, MARGIN_BOTTOM = 64, 20, 44, 40
FONT = cv2.FONT_HERSHEY_SIMPLEX


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """One line of a chart.

    Args:
        x: Steps.
        y: Values.
        color: RGB.
        width: Width [px].
    """

    x: Float[np.ndarray, 'n']
    y: Float[np.ndarray, 'n']
    color: tuple[int, int, int]
    width: int = 1


def line_chart(
    title: str, lines: Sequence[Line], borders: Sequence[tuple[float, str]], size: tuple[int, int]
) -> UInt8[np.ndarray, 'h w 3']:
    """Return a chart on a logarithmic scale.

    Args:
        title: Written above.
        lines: What to draw, in this order; values of 0 are drawn at the bottom.
        borders: Steps at which a part begins, and its name.
        size: Width and height [px].
    """
    width, height = size
    chart = np.full((height, width, 3), PAPER, dtype=np.uint8)
    values = np.concatenate([line.y for line in lines])
    positive = values[np.isfinite(values) & (values > 0)]
    low, high = _range(positive)
    last = max(float(line.x.max()) for line in lines)

    def place(x: Float[np.ndarray, 'n'], y: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'n 2']:
        u = MARGIN_LEFT + x / max(last, 1.0) * (width - MARGIN_LEFT - MARGIN_RIGHT)
        share = (np.log10(np.maximum(y, low)) - np.log10(low)) / np.log10(high / low)
        return np.column_stack([u, height - MARGIN_BOTTOM - share * (
            height - MARGIN_TOP - MARGIN_BOTTOM)])

    for value in _ticks(low, high):
        v = int(place(np.zeros(1), np.array([value]))[0, 1])
        cv2.line(chart, (MARGIN_LEFT, v), (width - MARGIN_RIGHT, v), (225, 226, 228), 1)
        cv2.putText(chart, f'{value:g}', (12, v + 4), FONT, 0.4, FAINT, 1, cv2.LINE_AA)
    for x, name in borders:
        u = int(place(np.array([x]), np.array([low]))[0, 0])
        cv2.line(chart, (u, MARGIN_TOP), (u, height - MARGIN_BOTTOM), FAINT, 1)
        long_px = cv2.getTextSize(name, FONT, 0.42, 1)[0][0]
        left = min(u + 5, width - long_px - 4)
        cv2.putText(chart, name, (left, height - 16), FONT, 0.42, INK, 1, cv2.LINE_AA)
    for line in lines:
        points = np.rint(place(line.x, line.y) * 16).astype(np.int32)
        cv2.polylines(chart, [points], False, line.color, line.width, cv2.LINE_AA, 4)
    cv2.putText(chart, title, (12, 24), FONT, 0.52, INK, 1, cv2.LINE_AA)
    return chart


def _range(positive: Float[np.ndarray, 'n']) -> tuple[float, float]:
    """Return the ends of the scale: a little more than the values, at least a factor of two."""
    if not len(positive):
        return 0.1, 1.0
    low, high = float(positive.min()) * 0.9, float(positive.max()) * 1.1
    return low, max(high, 2 * low)


def _ticks(low: float, high: float) -> list[float]:
    """Return round values (1, 2 and 5 times powers of ten) within a range."""
    powers = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    return [m * 10.0 ** p for p in powers for m in (1, 2, 5) if low <= m * 10.0 ** p <= high]
