"""Furniture that hides people, and seats made to fit the person who sits on them.

Everything is built around the origin of its own frame, facing +z, and moved into the room later.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.synthesis.blocks import Block, Texture, box, cylinder, ellipsoid
from pop_core.synthesis.rooms import any_colour, varied, wood_colour

Maker = Callable[[np.random.Generator], list[Block]]


@dataclass(frozen=True, slots=True)
class SeatFit:
    """Where a seat must end so that its sitter neither floats nor sinks in.

    Args:
        height_m: Top of the seat.
        back_m: Foremost z that a back rest may reach.
        front_m: Rearmost z of the shins: the seat ends before it.
        half_width_m: Largest |x| of pelvis and thighs.
    """

    height_m: float
    back_m: float
    front_m: float
    half_width_m: float


def table(rng: np.random.Generator) -> list[Block]:
    """Return a table, often with things on it."""
    w, d, h = rng.uniform(0.9, 1.8), rng.uniform(0.55, 0.9), rng.uniform(0.68, 0.82)
    return bare_table(w, d, h, rng) + _things_on_top(w, d, h, rng)


def bare_table(w: float, d: float, h: float, rng: np.random.Generator) -> list[Block]:
    """Return a table of width, depth and height [m], some with a panel before the legs."""
    colour, top = wood_colour(rng), rng.uniform(0.025, 0.05)
    parts = [box([w, top, d], [0, h - top, 0], colour, Texture.WOOD)]
    for x in (-1, 1):
        for z in (-1, 1):
            parts.append(box([0.06, h - top, 0.06], [x * (w / 2 - 0.06), 0, z * (d / 2 - 0.06)],
                             colour * 0.8))
    if rng.random() < 0.4:
        panel = rng.uniform(0.3, 0.6)
        parts.append(box([w - 0.16, panel, 0.02], [0, h - top - panel, d / 2 - 0.1], colour * 0.9))
    return parts


def crate(rng: np.random.Generator) -> list[Block]:
    """Return a box or a stack of two on the floor."""
    w, h, d = rng.uniform(0.4, 1.0), rng.uniform(0.4, 0.9), rng.uniform(0.3, 0.6)
    colour = varied((0.62, 0.48, 0.32), rng)
    parts = [box([w, h, d], [0, 0, 0], colour)]
    if rng.random() < 0.4:
        top = rng.uniform(0.25, 0.5)
        base = [rng.normal(0, 0.08), h, 0]
        parts.append(box([w * 0.7, top, d * 0.8], base, varied(colour, rng)))
    return parts


def counter(rng: np.random.Generator) -> list[Block]:
    """Return a reception desk or kitchen block, closed down to the floor."""
    w, h, d = rng.uniform(1.0, 2.0), rng.uniform(0.8, 1.1), rng.uniform(0.4, 0.6)
    colour = any_colour(rng)
    parts = [
        box([w, h - 0.04, d], [0, 0, 0], colour),
        box([w + 0.06, 0.04, d + 0.06], [0, h - 0.04, 0], wood_colour(rng), Texture.WOOD),
    ]
    return parts + _things_on_top(w, d, h, rng)


def pole(rng: np.random.Generator) -> list[Block]:
    """Return a column, or a thin pole as of a lamp or a stand."""
    r = rng.uniform(0.15, 0.35) if rng.random() < 0.6 else rng.uniform(0.04, 0.1)
    return [cylinder([r, 3.0, r], [0, 0, 0], any_colour(rng))]


def half_wall(rng: np.random.Generator) -> list[Block]:
    """Return a partition or the edge of a doorway, to be stood beside the line of sight."""
    w = rng.uniform(0.5, 1.2)
    h = 2.7 if rng.random() < 0.6 else rng.uniform(1.2, 1.8)
    return [box([w, h, 0.12], [0, 0, 0], varied((0.8, 0.79, 0.75), rng))]


def sofa(rng: np.random.Generator) -> list[Block]:
    """Return a sofa seen from any side."""
    seat = SeatFit(rng.uniform(0.38, 0.46), -0.25, 0.3, rng.uniform(0.45, 0.9))
    return sofa_for(seat, rng)


def chair(rng: np.random.Generator) -> list[Block]:
    """Return a chair with a closed back."""
    return chair_for(SeatFit(0.45, -0.2, 0.22, 0.2), rng)


def shelf(rng: np.random.Generator) -> list[Block]:
    """Return an open shelf: boards with gaps to look through."""
    w, h, d = rng.uniform(0.7, 1.3), rng.uniform(1.0, 1.9), 0.3
    colour = wood_colour(rng)
    parts = [box([0.03, h, d], [x * w / 2, 0, 0], colour) for x in (-1, 1)]
    for level in np.linspace(0.08, h - 0.03, int(rng.integers(3, 6))):
        parts.append(box([w, 0.03, d], [0, level, 0], colour, Texture.WOOD))
        n = int(rng.integers(0, 4))
        for x in rng.uniform(-0.4, 0.4, n) * w:
            parts.append(box([0.15, rng.uniform(0.12, 0.22), 0.2], [x, level + 0.03, 0],
                             any_colour(rng)))
    return parts


def sofa_for(seat: SeatFit, rng: np.random.Generator) -> list[Block]:
    """Return a sofa around a sitter."""
    colour = any_colour(rng)
    half, h = seat.half_width_m + rng.uniform(0.12, 0.5), seat.height_m
    length = seat.front_m - seat.back_m
    middle = (seat.front_m + seat.back_m) / 2
    back, arm = rng.uniform(0.35, 0.5), rng.uniform(0.12, 0.22)
    return [
        box([2 * half, h, length], [0, 0, middle], colour, Texture.CLOTH),
        box([2 * half + 0.3, h + back, 0.2], [0, 0, seat.back_m - 0.1], colour * 0.92,
            Texture.CLOTH),
        box([0.16, h + arm, length], [half + 0.08, 0, middle], colour * 0.95, Texture.CLOTH),
        box([0.16, h + arm, length], [-half - 0.08, 0, middle], colour * 0.95, Texture.CLOTH),
    ]


def chair_for(seat: SeatFit, rng: np.random.Generator) -> list[Block]:
    """Return a chair under a sitter."""
    colour = wood_colour(rng) if rng.random() < 0.6 else any_colour(rng)
    half, h = max(0.2, seat.half_width_m), seat.height_m
    length = seat.front_m - seat.back_m
    middle = (seat.front_m + seat.back_m) / 2
    parts = [box([2 * half, 0.04, length], [0, h - 0.04, middle], colour, Texture.WOOD)]
    for x in (-1, 1):
        for z in (seat.back_m + 0.02, seat.front_m - 0.02):
            parts.append(box([0.04, h - 0.04, 0.04], [x * (half - 0.02), 0, z], colour * 0.85))
    back = rng.uniform(0.35, 0.55)
    parts.append(box([2 * half, back, 0.03], [0, h + 0.02, seat.back_m - 0.015], colour))
    return parts


def stool_for(seat: SeatFit, rng: np.random.Generator) -> list[Block]:
    """Return a stool or a box to sit on."""
    length = min(0.42, seat.front_m - seat.back_m)
    size = [min(0.42, 2 * seat.half_width_m), seat.height_m, length]
    return [box(size, [0, 0, seat.back_m + length / 2], any_colour(rng))]


def bed_for(
    low: Float[np.ndarray, '3'], high: Float[np.ndarray, '3'], height_m: float,
    rng: np.random.Generator,
) -> list[Block]:
    """Return a bed under somebody who occupies the given box of its own frame [m]."""
    size = [high[0] - low[0] + 0.3, height_m, high[2] - low[2] + 0.3]
    middle = (low + high) / 2
    cloth = any_colour(rng)
    return [
        box([size[0], height_m - 0.12, size[2]], [middle[0], 0, middle[2]], wood_colour(rng)),
        box([size[0], 0.12, size[2]], [middle[0], height_m - 0.12, middle[2]], cloth,
            Texture.CLOTH),
    ]


def _things_on_top(
    w: float, d: float, h: float, rng: np.random.Generator
) -> list[Block]:
    """Return a few objects on a surface: screens, cups, stacks, a bag."""
    parts = []
    for _ in range(rng.integers(0, 4)):
        x, z = rng.uniform(-0.4, 0.4) * w, rng.uniform(-0.3, 0.3) * d
        kind = rng.integers(4)
        if kind == 0:
            parts += [
                box([0.5, 0.3, 0.03], [x, h + 0.12, z], np.full(3, 0.07)),
                box([0.06, 0.12, 0.04], [x, h, z], np.full(3, 0.15)),
            ]
        elif kind == 1:
            parts.append(cylinder([0.08, 0.1, 0.08], [x, h, z], any_colour(rng)))
        elif kind == 2:
            parts.append(box([0.22, rng.uniform(0.04, 0.2), 0.3], [x, h, z], any_colour(rng)))
        else:
            parts.append(ellipsoid([0.35, 0.25, 0.2], [x, h - 0.01, z], any_colour(rng)))
    return parts


OCCLUDERS: tuple[Maker, ...] = (table, crate, counter, pole, half_wall, sofa, chair, shelf)
