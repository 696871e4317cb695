"""A plain colour image of a scene: Lambert light, one shadow, patterns on floor and cloth.

Colours only have to look like something to people; depth is what the methods read.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8

from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import invert_transform, transform_points
from pop_core.rendering.depth_renderer import RenderedDepth, render_depth, vertex_normals
from pop_core.synthesis.blocks import Surface, Texture
from pop_core.synthesis.shading_kernels import interpolate

AMBIENT = 0.42
SHADOW_SHARE = 0.55
SHADOW_BIAS_M = 0.05
LIGHT_SIZE_PX = 512


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """All triangles of a scene, joined.

    Args:
        vertices: Points, camera frame [m].
        faces: Triangles.
        albedo: Reflectance per vertex.
        texture: Texture per triangle.
    """

    vertices: Float[np.ndarray, 'n 3']
    faces: Int[np.ndarray, 'm 3']
    albedo: Float[np.ndarray, 'n 3']
    texture: Int[np.ndarray, 'm']


def joined(surfaces: Sequence[Surface]) -> Stage:
    """Return surfaces as one set of triangles."""
    starts = np.cumsum([0, *(len(surface.vertices) for surface in surfaces)])
    faces = [surface.faces + start for surface, start in zip(surfaces, starts, strict=False)]
    texture = [np.full(len(surface.faces), int(surface.texture)) for surface in surfaces]
    return Stage(
        np.concatenate([surface.vertices for surface in surfaces]),
        np.concatenate(faces).astype(np.int64),
        np.concatenate([surface.albedo for surface in surfaces]),
        np.concatenate(texture),
    )


def shade(
    stage: Stage, rendered: RenderedDepth, camera: Camera, *,
    T_room_camera: Float[np.ndarray, '4 4'], light_room: Float[np.ndarray, '3'],
    rng: np.random.Generator,
) -> UInt8[np.ndarray, 'h w 3']:
    """Return the colour image of a rendered stage.

    Args:
        stage: Triangles, camera frame.
        rendered: Their depth image.
        camera: Camera without distortion.
        T_room_camera: Room from camera, for patterns that lie in the room.
        light_room: A lamp near the ceiling, room frame [m].
        rng: Randomness of the sensor's noise.
    """
    covered = rendered.covered
    depth = np.where(covered, rendered.depth_m, np.float32(1.0))
    rays = camera.ray_grid().astype(np.float32)
    points = np.dstack([rays * depth[..., None], depth])
    attributes = np.hstack([vertex_normals(stage.vertices, stage.faces), stage.albedo])
    values = np.zeros((*covered.shape, 6), dtype=np.float32)
    interpolate(points, rendered.face, stage.vertices, stage.faces, attributes, values)
    light = transform_points(invert_transform(T_room_camera), light_room[None])[0]
    toward = light.astype(np.float32) - points
    distance = np.linalg.norm(toward, axis=-1, keepdims=True)
    cosine = np.clip((values[..., :3] * toward / distance).sum(axis=-1), 0.0, 1.0)
    lit = 1.0 - SHADOW_SHARE * _shadow(stage, points, T_room_camera, light_room)
    power = (AMBIENT + (1 - AMBIENT) * cosine * lit) * 0.95
    pattern = _pattern(stage.texture[rendered.face], transform_points(T_room_camera, points))
    colour = values[..., 3:] * (power * pattern)[..., None]
    colour = np.where(covered[..., None], colour, 0.02)
    grain = rng.standard_normal(colour.shape, dtype=np.float32) * 3
    noisy = np.sqrt(np.clip(colour, 0, 1)) * 245 + grain
    return np.clip(noisy, 0, 255).astype(np.uint8)


def _shadow(
    stage: Stage, points: Float[np.ndarray, 'h w 3'], T_room_camera: Float[np.ndarray, '4 4'],
    light_room: Float[np.ndarray, '3'],
) -> Float[np.ndarray, 'h w']:
    """Return 1 where something stands between the lamp and a point (Williams 1978)."""
    # The lamp looks down: its x is the room's x, its y the room's z, its z the room's -y.
    R_light_room = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    T_light_camera = np.eye(4)
    T_light_camera[:3, :3] = R_light_room @ T_room_camera[:3, :3]
    T_light_camera[:3, 3] = R_light_room @ (T_room_camera[:3, 3] - light_room)
    half = (LIGHT_SIZE_PX - 1) / 2
    lamp = Camera(LIGHT_SIZE_PX, LIGHT_SIZE_PX, half / 1.6, half / 1.6, half, half)
    lamp_view = transform_points(T_light_camera, stage.vertices)
    map_m = render_depth(lamp_view, stage.faces, lamp).depth_m
    seen = transform_points(T_light_camera, points)
    z = np.maximum(seen[..., 2], 1e-3)
    uv = np.rint(seen[..., :2] / z[..., None] * lamp.fx + half)
    inside = ((uv >= 0) & (uv < LIGHT_SIZE_PX)).all(axis=-1) & (seen[..., 2] > 0.05)
    u, v = np.where(inside[..., None], uv, 0).astype(np.int64).transpose(2, 0, 1)
    return (inside & (map_m[v, u] < z - SHADOW_BIAS_M)).astype(np.float64)


def _pattern(
    texture: Int[np.ndarray, 'h w'], p_room: Float[np.ndarray, 'h w 3']
) -> Float[np.ndarray, 'h w']:
    """Return the brightness that the pattern of each pixel's surface multiplies."""
    out = np.ones(texture.shape)
    for kind, rule in _PATTERNS.items():
        chosen = texture == int(kind)
        if chosen.any():
            out[chosen] = rule(p_room[chosen])
    return out


def _boards(p: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n']:
    row = np.floor(p[:, 0] / 0.15)
    along = p[:, 2] + _hash(row, 0.0 * row) * 1.4
    tone = 0.84 + 0.24 * _hash(row, np.floor(along / 1.4))
    gap = (np.abs(p[:, 0] / 0.15 - row - 0.5) > 0.48) | (np.abs(along / 1.4 % 1 - 0.5) > 0.496)
    grain = 0.03 * np.sin(p[:, 0] * 210 + 4 * np.sin(p[:, 2] * 3 + row))
    return np.where(gap, tone * 0.6, tone + grain)


def _tiles(p: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n']:
    cell = p[:, [0, 2]] / 0.4
    joint = (np.abs(cell % 1 - 0.5) > 0.485).any(axis=1)
    return np.where(joint, 0.72, 0.94 + 0.1 * _hash(np.floor(cell[:, 0]), np.floor(cell[:, 1])))


def _wood(p: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n']:
    return 0.95 + 0.06 * np.sin(p[:, 1] * 60 + p[:, 2] * 90 + 3 * np.sin(p[:, 0] * 5))


def _cloth(p: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n']:
    return 0.96 + 0.05 * _hash(np.floor(p[:, 0] * 90), np.floor((p[:, 1] + p[:, 2]) * 90))


def _hash(a: Float[np.ndarray, 'n'], b: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'n']:
    """Return numbers in 0..1 that look random but belong to the cell (a, b)."""
    return np.abs(np.sin(a * 12.9898 + b * 78.233) * 43758.5453) % 1.0


_PATTERNS = {
    Texture.BOARDS: _boards, Texture.TILES: _tiles, Texture.WOOD: _wood, Texture.CLOTH: _cloth,
}
