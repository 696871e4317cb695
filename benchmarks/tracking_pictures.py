"""The picture of a tracking run: errors over the time since the camera last saw a joint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8

from benchmarks.tracking_summary import SINCE_SEEN
from pop_core.rendering.palette import FAINT, INK, PAPER, person_color

Picture = UInt8[np.ndarray, 'h w 3']
SIZE = (960, 440)
LEFT, RIGHT, TOP, BOTTOM = 20, 20, 70, 70
BAR_SHARE = 0.7  # of the width of a group


def draw_chart(path: Path, summaries: dict[str, dict[str, Any]]) -> None:
    """Write the chart as a PNG."""
    cv2.imwrite(str(path), since_seen_chart(summaries)[..., ::-1])


def since_seen_chart(summaries: dict[str, dict[str, Any]]) -> Picture:
    """Return bars of the mean error of joints [mm], grouped by the time since they were seen."""
    width, height = SIZE
    chart = np.full((height, width, 3), PAPER, dtype=np.uint8)
    title = 'mean error of joints [mm], by the time since the camera saw them'
    _write(chart, title, (16, 28), INK)
    means = np.array([
        [1e3 * summary['since_seen_m'][label]['mean'] for label, _ in SINCE_SEEN]
        for summary in summaries.values()])
    highest = float(np.nanmax(means)) if np.isfinite(means).any() else 1.0
    group_px = (width - LEFT - RIGHT) / len(SINCE_SEEN)
    bar_px = BAR_SHARE * group_px / len(means)
    first = next(iter(summaries.values()))
    for k, (label, _) in enumerate(SINCE_SEEN):
        start = LEFT + (k + (1 - BAR_SHARE) / 2) * group_px
        for m, value in enumerate(means[:, k]):
            if np.isfinite(value):
                _bar(chart, start + m * bar_px, bar_px, float(value), highest, m)
        _write(chart, label, (int(start), height - BOTTOM + 22), INK)
        count = first['since_seen_m'][label]['n']
        _write(chart, f'{count} joints', (int(start), height - BOTTOM + 42), FAINT)
    for m, name in enumerate(summaries):
        left = 16 + 140 * m
        cv2.rectangle(chart, (left, 42), (left + 14, 56), person_color(m), -1)
        _write(chart, name, (left + 22, 55), INK)
    return chart


def _bar(
    chart: Picture, left: float, wide: float, value_mm: float, highest_mm: float, method: int
) -> None:
    """Draw one bar and its value."""
    floor = SIZE[1] - BOTTOM
    top = floor - value_mm / highest_mm * (floor - TOP - 20)
    cv2.rectangle(chart, (round(left), round(top)), (round(left + wide) - 3, floor),
                  person_color(method), -1)
    _write(chart, f'{value_mm:.0f}', (round(left) + 4, round(top) - 6), INK)


def _write(
    chart: Picture, text: str, where: tuple[int, int], colour: tuple[int, int, int]
) -> None:
    cv2.putText(chart, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.42, colour, 1, cv2.LINE_AA)
