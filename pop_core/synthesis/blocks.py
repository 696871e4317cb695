"""Solid primitives that furniture is made of, and triangle surfaces with colour.

The `room` frame has y up, the floor at y = 0 and, in front of a person who faces it, +z. Metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cache

import numpy as np
from jaxtyping import Float, Int

CELL_M = 0.3  # the rasteriser drops triangles that touch the camera plane: keep them small
SIDES = 20

Lengths = Sequence[float | int]  # three of them [m]


class Shape(IntEnum):
    """Form of a block within its bounding box."""

    BOX = 0
    CYLINDER = 1
    ELLIPSOID = 2


class Texture(IntEnum):
    """Pattern that a surface shows in the colour image."""

    PLAIN = 0
    BOARDS = 1
    TILES = 2
    WOOD = 3
    CLOTH = 4


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A solid that stands upright in the room.

    Args:
        shape: Form within its box.
        size_m: Full extent along its own x, y, z [m].
        base: Centre of its underside, room frame [m].
        yaw_rad: Turn about the vertical.
        colour: Reflectance of red, green, blue, 0..1.
        texture: Pattern of its surface.
    """

    shape: Shape
    size_m: Float[np.ndarray, '3']
    base: Float[np.ndarray, '3']
    yaw_rad: float
    colour: Float[np.ndarray, '3']
    texture: Texture = Texture.PLAIN


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles with colour.

    Args:
        vertices: Points [m], room or camera frame.
        faces: Triangles, outward by the right hand rule.
        albedo: Reflectance of red, green, blue per vertex, 0..1.
        texture: Pattern.
    """

    vertices: Float[np.ndarray, 'n 3']
    faces: Int[np.ndarray, 'm 3']
    albedo: Float[np.ndarray, 'n 3']
    texture: Texture = Texture.PLAIN


def yaw_matrix(yaw_rad: float) -> Float[np.ndarray, '3 3']:
    """Return the rotation about the vertical (y) that turns +z toward +x."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def box(
    size_m: Lengths, base: Lengths, colour: Float[np.ndarray, '3'],
    texture: Texture = Texture.PLAIN,
) -> Block:
    """Return a box aligned with the room, standing on the centre of its underside."""
    return Block(Shape.BOX, np.array(size_m, float), np.array(base, float), 0.0, colour, texture)


def cylinder(
    size_m: Lengths, base: Lengths, colour: Float[np.ndarray, '3']
) -> Block:
    """Return an upright cylinder of the given extents."""
    return Block(Shape.CYLINDER, np.array(size_m, float), np.array(base, float), 0.0, colour)


def ellipsoid(
    size_m: Lengths, base: Lengths, colour: Float[np.ndarray, '3']
) -> Block:
    """Return an ellipsoid of the given extents, lying on `base`."""
    return Block(Shape.ELLIPSOID, np.array(size_m, float), np.array(base, float), 0.0, colour)


def moved(
    blocks: Sequence[Block], position: Float[np.ndarray, '3'], yaw_rad: float
) -> tuple[Block, ...]:
    """Return blocks turned about the origin's vertical, then shifted [m]."""
    turn = yaw_matrix(yaw_rad)
    return tuple(
        replace(block, base=turn @ block.base + position, yaw_rad=block.yaw_rad + yaw_rad)
        for block in blocks
    )


def depth_inside(
    block: Block, p_room: Float[np.ndarray, 'n 3']
) -> Float[np.ndarray, 'n']:
    """Return how deep points lie inside a block [m]; negative outside.

    Exact for boxes; for round shapes a bound that is exact on the surface.
    """
    half = block.size_m / 2
    local = (p_room - block.base) @ yaw_matrix(block.yaw_rad) - np.array([0.0, half[1], 0.0])
    if block.shape is Shape.BOX:
        return (half - np.abs(local)).min(axis=1)
    if block.shape is Shape.CYLINDER:
        rim = (1.0 - np.hypot(local[:, 0] / half[0], local[:, 2] / half[2])) * half[[0, 2]].min()
        return np.minimum(rim, half[1] - np.abs(local[:, 1]))
    return (1.0 - np.linalg.norm(local / half, axis=1)) * half.min()


def is_near(block: Block, p_room: Float[np.ndarray, 'n 3']) -> bool:
    """Return whether the bounding box of points comes within a block's bounding sphere."""
    centre = block.base + np.array([0.0, block.size_m[1] / 2, 0.0])
    outside = np.maximum(p_room.min(axis=0) - centre, centre - p_room.max(axis=0))
    reach = 0.5 * np.linalg.norm(block.size_m)
    return bool(np.linalg.norm(np.maximum(outside, 0.0)) < reach)


def block_surface(block: Block) -> Surface:
    """Return the triangles of a block in the room frame [m]."""
    if block.shape is Shape.BOX:
        local, faces = _box_sides(block.size_m)
    else:
        unit, faces = _unit_round(block.shape)
        local = unit * block.size_m
    vertices = local @ yaw_matrix(block.yaw_rad).T + block.base
    return Surface(vertices, faces, np.tile(block.colour, (len(vertices), 1)), block.texture)


def grid(
    corner: Float[np.ndarray, '3'], u: Float[np.ndarray, '3'], v: Float[np.ndarray, '3'],
    cell_m: float = CELL_M,
) -> tuple[Float[np.ndarray, 'n 3'], Int[np.ndarray, 'm 3']]:
    """Return a parallelogram cut into cells, facing u x v."""
    nu = max(1, int(np.ceil(np.linalg.norm(u) / cell_m)))
    nv = max(1, int(np.ceil(np.linalg.norm(v) / cell_m)))
    a, b, faces = _unit_grid(nu, nv)
    return corner + a * u + b * v, faces


@cache
def _unit_grid(
    nu: int, nv: int
) -> tuple[Float[np.ndarray, 'n 1'], Float[np.ndarray, 'n 1'], Int[np.ndarray, 'm 3']]:
    a, b = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1), indexing='ij')
    return a.reshape(-1, 1), b.reshape(-1, 1), _grid_faces(nu, nv)


def _grid_faces(nu: int, nv: int) -> Int[np.ndarray, 'm 3']:
    i, j = np.meshgrid(np.arange(nu), np.arange(nv), indexing='ij')
    a = (i * (nv + 1) + j).ravel()
    b, c, d = a + nv + 1, a + nv + 2, a + 1
    return np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def _box_sides(
    size_m: Float[np.ndarray, '3']
) -> tuple[Float[np.ndarray, 'n 3'], Int[np.ndarray, 'm 3']]:
    """Return the six sides of a box on the centre of its underside."""
    low, axes = size_m * np.array([-0.5, 0.0, -0.5]), np.diag(size_m)
    vertices: list[Float[np.ndarray, 'n 3']] = []
    faces, count = [], 0
    for k in range(3):
        u, v = axes[(k + 1) % 3], axes[(k + 2) % 3]
        for side, triangles in (grid(low + axes[k], u, v), grid(low, v, u)):
            vertices.append(side)
            faces.append(triangles + count)
            count += len(side)
    return np.concatenate(vertices), np.concatenate(faces)


@cache
def _unit_round(shape: Shape) -> tuple[Float[np.ndarray, 'n 3'], Int[np.ndarray, 'm 3']]:
    """Return a unit cylinder or sphere about the vertical axis, underside at y = 0."""
    if shape is Shape.CYLINDER:
        radius = np.array([0.0, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.0])
        height = np.concatenate([[0.0], np.linspace(0, 1, 8), [1.0]])
    else:
        polar = np.linspace(0, np.pi, 13)
        radius, height = np.sin(polar) / 2, (1 - np.cos(polar)) / 2
    around = np.linspace(0, 2 * np.pi, SIDES + 1)
    x = radius[:, None] * np.sin(around)
    z = radius[:, None] * np.cos(around)
    y = np.broadcast_to(height[:, None], x.shape)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return vertices, _grid_faces(len(radius) - 1, SIDES)[:, ::-1]
