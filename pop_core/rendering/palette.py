"""Colours of people and captions (RGB, 0..255): soft, distinct, also for colour-blind readers."""

from __future__ import annotations

# Okabe and Ito (2008), lightened so that shading still reads.
PEOPLE = (
    (245, 178, 66), (103, 184, 235), (79, 190, 150), (232, 130, 84), (214, 148, 190),
    (240, 228, 110), (90, 140, 220),
)
INK = (28, 32, 38)
PAPER = (250, 250, 248)
FAINT = (150, 154, 160)


def person_color(index: int) -> tuple[int, int, int]:
    """Return the colour of the nth person of a frame."""
    return PEOPLE[index % len(PEOPLE)]
