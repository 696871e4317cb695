"""Things that look like people to a depth camera, and things that rooms are full of."""

from __future__ import annotations

import numpy as np

from pop_core.synthesis.blocks import Block, box, cylinder, ellipsoid, moved
from pop_core.synthesis.occluders import (
    OCCLUDERS,
    chair,
    crate,
    half_wall,
    pole,
    shelf,
    sofa,
    table,
)
from pop_core.synthesis.rooms import any_colour


def office_chair(rng: np.random.Generator) -> list[Block]:
    """Return a swivel chair: a star of feet, a column, a seat, a back, often arm rests."""
    colour, seat_m = any_colour(rng), rng.uniform(0.4, 0.55)
    w, back_m = rng.uniform(0.4, 0.55), rng.uniform(0.35, 0.75)
    parts = [cylinder([0.06, seat_m, 0.06], [0, 0, 0], colour)]
    for angle in np.arange(5) * 2 * np.pi / 5:
        foot = box([0.05, 0.06, 0.3], [0, 0.03, 0.15], colour)
        parts += moved([foot], np.zeros(3), float(angle))
    parts.append(box([w, rng.uniform(0.05, 0.12), w], [0, seat_m - 0.05, 0], colour))
    lift = rng.uniform(0.05, 0.2)
    make = ellipsoid if rng.random() < 0.4 else box
    parts.append(make([w * rng.uniform(0.8, 1.0), back_m, rng.uniform(0.05, 0.14)],
                      [0, seat_m + lift, -w / 2], colour))
    if rng.random() < 0.3:
        parts.append(ellipsoid([0.28, 0.18, 0.1], [0, seat_m + lift + back_m + 0.03, -w / 2],
                               colour))
    if rng.random() < 0.6:
        for x in (-w / 2, w / 2):
            parts.append(box([0.06, 0.04, 0.28], [x, seat_m + 0.2, 0], colour))
            parts.append(box([0.04, 0.24, 0.05], [x, seat_m - 0.03, 0], colour))
    return parts


def mannequin(rng: np.random.Generator) -> list[Block]:
    """Return a bust on a pole, or a coat on a stand: parts of a person that are none."""
    stem = rng.uniform(0.5, 1.1)
    trunk = [rng.uniform(0.3, 0.5), rng.uniform(0.4, 0.9), rng.uniform(0.18, 0.3)]
    parts = [
        cylinder([0.04, stem + 0.2, 0.04], [0, 0, 0], any_colour(rng)),
        cylinder([0.35, 0.03, 0.35], [0, 0, 0], any_colour(rng)),
        ellipsoid(trunk, [0, stem, 0], any_colour(rng)),
    ]
    if rng.random() < 0.3:
        parts.append(ellipsoid([0.2, 0.26, 0.22], [0, stem + trunk[1] * 0.97, 0],
                               any_colour(rng)))
    return parts


def heap(rng: np.random.Generator) -> list[Block]:
    """Return a random pile of primitives: bags, machines, plants, whatever."""
    parts: list[Block] = []
    level = 0.0
    for _ in range(rng.integers(1, 7)):
        size = np.exp(rng.uniform(np.log(0.06), np.log(0.9), 3)).tolist()
        at = [rng.normal(0, 0.2), max(0.0, level + rng.normal(0, 0.08)), rng.normal(0, 0.15)]
        make = (box, cylinder, ellipsoid)[rng.integers(3)]
        parts += moved([make(size, at, any_colour(rng))], np.zeros(3), rng.uniform(0, np.pi))
        level = min(1.6, level + size[1] * rng.uniform(0.3, 1.0))
    return parts


def lamp(rng: np.random.Generator) -> list[Block]:
    """Return a floor lamp: a foot, a thin pole and a shade where a head might be."""
    height, shade = rng.uniform(1.2, 1.9), rng.uniform(0.2, 0.5)
    return [
        cylinder([0.3, 0.03, 0.3], [0, 0, 0], any_colour(rng)),
        cylinder([0.03, height, 0.03], [0, 0, 0], any_colour(rng)),
        (cylinder if rng.random() < 0.5 else ellipsoid)(
            [shade, rng.uniform(0.15, 0.4), shade], [0, height - 0.1, 0], any_colour(rng)),
    ]


FURNITURE = (*OCCLUDERS, chair, sofa, table, shelf, office_chair, office_chair, office_chair,
             mannequin, heap, heap, heap, lamp, pole, half_wall, crate)


def draw_thing(rng: np.random.Generator) -> list[Block]:
    """Return one piece of furniture, clutter or false person around the origin."""
    return FURNITURE[int(rng.integers(len(FURNITURE)))](rng)
