"""Empty rooms and the things that stand around in them, room frame [m]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.synthesis.blocks import (
    Block,
    Surface,
    Texture,
    box,
    cylinder,
    ellipsoid,
    grid,
    moved,
)

FLOOR_COLOURS = ((0.55, 0.38, 0.24), (0.42, 0.28, 0.18), (0.66, 0.54, 0.40), (0.52, 0.52, 0.50))
WALL_COLOURS = ((0.86, 0.84, 0.79), (0.74, 0.80, 0.83), (0.84, 0.78, 0.66), (0.72, 0.78, 0.70))


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """Inner faces of a room around the origin.

    Args:
        half_width_m: Side walls stand at x = -/+ this [m].
        back_m: The wall behind the people stands at z = -back_m [m].
        front_m: The room reaches to z = front_m [m], behind the camera.
        height_m: Ceiling [m].
        floor_colour: Reflectance.
        wall_colour: Reflectance.
        floor_texture: Pattern of the floor.
    """

    half_width_m: float
    back_m: float
    front_m: float
    height_m: float
    floor_colour: Float[np.ndarray, '3']
    wall_colour: Float[np.ndarray, '3']
    floor_texture: Texture


def draw_room(rng: np.random.Generator) -> Room:
    """Return a random room large enough for the camera distances of scenes."""
    return Room(
        half_width_m=rng.uniform(2.2, 4.0),
        back_m=rng.uniform(1.2, 3.0),
        front_m=6.5,
        height_m=rng.uniform(2.4, 3.0),
        floor_colour=varied(FLOOR_COLOURS[rng.integers(len(FLOOR_COLOURS))], rng),
        wall_colour=varied(WALL_COLOURS[rng.integers(len(WALL_COLOURS))], rng),
        floor_texture=Texture.BOARDS if rng.random() < 0.7 else Texture.TILES,
    )


def room_surfaces(room: Room) -> tuple[Surface, ...]:
    """Return floor, back wall, side walls and ceiling, facing inward."""
    w, b, f, h = room.half_width_m, room.back_m, room.front_m, room.height_m
    x, y, z = np.diag([2 * w, h, f + b])
    low = np.array([-w, 0.0, -b])
    ceiling_colour = np.full(3, 0.9)
    sheets = (
        (low, z, x, room.floor_colour, room.floor_texture),
        (low, x, y, room.wall_colour, Texture.PLAIN),
        (low, y, z, room.wall_colour * 0.96, Texture.PLAIN),
        (low + x, z, y, room.wall_colour * 0.96, Texture.PLAIN),
        (low + y, x, z, ceiling_colour, Texture.PLAIN),
    )
    return tuple(_sheet(*sheet) for sheet in sheets)


def draw_clutter(room: Room, rng: np.random.Generator, count: int) -> tuple[Block, ...]:
    """Return things along the walls: cabinets, shelves, plants, coat stands, pictures."""
    kinds = (_cabinet, _plant, _coat_stand, _picture, _crates)
    blocks: list[Block] = []
    for _ in range(count):
        thing = kinds[rng.integers(len(kinds))](rng)
        depth = max(block.size_m[2] for block in thing)
        side = int(rng.integers(3))
        if side == 0:
            place = [rng.uniform(-0.9, 0.9) * (room.half_width_m - 0.4), 0, 0.02 - room.back_m]
            place[2] += depth / 2
            yaw = 0.0
        else:
            sign = 1 if side == 1 else -1
            place = [sign * (room.half_width_m - depth / 2 - 0.02), 0,
                     rng.uniform(0.5 - room.back_m, 1.5)]
            yaw = -sign * np.pi / 2
        blocks += moved(thing, np.array(place), yaw)
    return tuple(blocks)


def varied(
    colour: tuple[float, float, float] | Float[np.ndarray, '3'], rng: np.random.Generator
) -> Float[np.ndarray, '3']:
    """Return a colour near the given one, within the range of reflectances."""
    return np.clip(np.asarray(colour) * rng.uniform(0.85, 1.15) + rng.normal(0, 0.02, 3), 0.02, 1)


def any_colour(rng: np.random.Generator) -> Float[np.ndarray, '3']:
    """Return a colour as painted things have: one hue, not too saturated."""
    grey = rng.uniform(0.15, 0.75)
    return np.clip(grey + rng.normal(0, 0.14, 3), 0.04, 0.95)


def wood_colour(rng: np.random.Generator) -> Float[np.ndarray, '3']:
    """Return the colour of some wood."""
    return varied((0.58, 0.40, 0.25), rng) * rng.uniform(0.55, 1.2)


def _sheet(
    corner: Float[np.ndarray, '3'], u: Float[np.ndarray, '3'], v: Float[np.ndarray, '3'],
    colour: Float[np.ndarray, '3'], texture: Texture,
) -> Surface:
    vertices, faces = grid(corner, u, v, cell_m=0.4)
    return Surface(vertices, faces, np.tile(colour, (len(vertices), 1)), texture)


def _cabinet(rng: np.random.Generator) -> list[Block]:
    colour = wood_colour(rng)
    w, h, d = rng.uniform(0.5, 1.4), rng.uniform(0.6, 2.0), rng.uniform(0.3, 0.5)
    parts = [box([w, h, d], [0, 0, 0], colour, Texture.WOOD)]
    for level in np.arange(0.35, h - 0.1, 0.4):
        parts.append(box([w * 0.92, 0.02, 0.02], [0, level, d / 2], colour * 0.5))
    return parts


def _plant(rng: np.random.Generator) -> list[Block]:
    pot, crown = rng.uniform(0.25, 0.4), rng.uniform(0.4, 0.7)
    green = varied((0.20, 0.38, 0.16), rng)
    stem = rng.uniform(0.3, 0.8)
    return [
        cylinder([pot, pot, pot], [0, 0, 0], varied((0.6, 0.35, 0.25), rng)),
        cylinder([0.04, stem, 0.04], [0, pot, 0], green * 0.7),
        ellipsoid([crown, crown * 1.3, crown], [0, pot + stem * 0.5, 0], green),
    ]


def _coat_stand(rng: np.random.Generator) -> list[Block]:
    """Return a pole with a coat and a hat: the classic false person."""
    coat = any_colour(rng)
    return [
        cylinder([0.05, 1.75, 0.05], [0, 0, 0], wood_colour(rng)),
        ellipsoid([rng.uniform(0.3, 0.5), rng.uniform(0.8, 1.1), 0.25], [0, 0.6, 0], coat),
        ellipsoid([0.24, 0.12, 0.26], [0, 1.68, 0], any_colour(rng)),
    ]


def _picture(rng: np.random.Generator) -> list[Block]:
    w, h = rng.uniform(0.4, 1.2), rng.uniform(0.4, 0.9)
    level = rng.uniform(1.2, 1.5)
    return [
        box([w + 0.06, h + 0.06, 0.03], [0, level - 0.03, 0], any_colour(rng) * 0.4),
        box([w, h, 0.04], [0, level, 0], any_colour(rng)),
    ]


def _crates(rng: np.random.Generator) -> list[Block]:
    parts, level = [], 0.0
    for _ in range(rng.integers(1, 4)):
        size = rng.uniform(0.3, 0.55, 3)
        parts.append(box(size.tolist(), [rng.normal(0, 0.04), level, 0],
                         varied((0.62, 0.48, 0.32), rng)))
        level += float(size[1])
    return parts
