"""The picture of a tracking run: errors over the time since the camera last saw a joint."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import UInt8

from benchmarks.tracking_summary import SINCE_SEEN
from pop_core.rendering.line_chart import Line, line_chart

COLOURS = ((214, 120, 40), (40, 110, 190), (60, 150, 90))
COLOUR_NAMES = ('orange', 'blue', 'green')
SIZE = (900, 420)


def draw_chart(path: Path, summaries: dict[str, dict[str, Any]]) -> None:
    """Write the chart as a PNG."""
    cv2.imwrite(str(path), since_seen_chart(summaries)[..., ::-1])


def since_seen_chart(summaries: dict[str, dict[str, Any]]) -> UInt8[np.ndarray, 'h w 3']:
    """Return mean errors of joints [mm] over the time since they were seen, a line per method."""
    lines = []
    for colour, summary in zip(COLOURS, summaries.values(), strict=False):
        means = np.array([summary['since_seen_m'][label]['mean'] for label, _ in SINCE_SEEN])
        known = np.isfinite(means)
        x = np.arange(len(SINCE_SEEN), dtype=np.float64)
        lines.append(Line(x[known], 1e3 * means[known], colour, 3))
    legend = ', '.join(
        f'{colour}: {name}' for colour, name in zip(COLOUR_NAMES, summaries, strict=False))
    labels = ('seen now', '< 0.5 s', '< 1 s', '< 2 s', '< 3 s', 'longer', 'never')
    borders = [(float(k), label) for k, label in enumerate(labels)]
    return line_chart(
        f'mean error [mm] over the time since the joint was seen ({legend})', lines, borders,
        SIZE)
