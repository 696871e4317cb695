"""The course of a training as a picture: what is still missed, on a logarithmic scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from pop_core.rendering.line_chart import Line, line_chart

SIZE = (900, 420)
# Figure, colour: drawn as 1 - figure.
SHOWN = {
    'pck_visible': (30, 120, 200), 'pck_hidden': (220, 120, 30), 'part_iou': (60, 160, 70),
    'person_iou': (150, 80, 170),
}
WORDS = 'missed: visible joints (blue), hidden joints (orange), parts (green), people (violet)'


def save_curves(history: Sequence[Mapping[str, float]], path: Path) -> None:
    """Draw validation figures over thousands of images; nothing before the first two."""
    known = [entry for entry in history if set(SHOWN) <= set(entry)]
    if len(known) < 2:
        return
    thousands = np.array([entry['images'] for entry in known]) / 1e3
    lines = [
        Line(thousands, 1.0 - np.array([entry[name] for entry in known]), colour, 2)
        for name, colour in SHOWN.items()]
    title = f'{WORDS}; {thousands[-1]:.0f} thousand images'
    cv2.imwrite(str(path), line_chart(title, lines, [], SIZE)[..., ::-1])
