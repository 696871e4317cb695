"""Scenes for training as objects: drawn around a camera, with quick checks (room frame, [m]).

`draw_layout` aims a camera at people and rejects what does not fit exactly; here the camera comes
first, people stand anywhere before it, also cut by the border, and a chair that touches a sleeve
does no harm.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import invert_transform
from pop_core.synthesis.blocks import Block, Texture, depth_inside, is_near, moved
from pop_core.synthesis.cameras import look_at
from pop_core.synthesis.layouts import Layout
from pop_core.synthesis.negatives import draw_thing
from pop_core.synthesis.occlusion import before_person
from pop_core.synthesis.people import Actor, actor_at
from pop_core.synthesis.props import draw_prop
from pop_core.synthesis.rooms import Room, draw_clutter
from pop_core.synthesis.troupe import Troupe

COUNT_SHARES = (0.12, 0.34, 0.24, 0.13, 0.08, 0.05, 0.04)  # of 0, 1, 2 ... people
OCCLUDED_SHARE = 0.55
PROP_SHARE = 0.15
BEHIND_SHARE = 0.3   # of people placed behind somebody
HEIGHT_M, DISTANCE_M = (0.4, 2.6), (0.9, 6.5)
FOCAL_JITTER, CENTRE_JITTER = 0.04, 0.22
ROLL_DEG = 8.0
EYE_GAP_M, SIDE_GAP_M = 0.5, 0.04
TRIES = 10


def draw_training_layout(
    troupe: Troupe, size: tuple[int, int], focal_px: float, rng: np.random.Generator
) -> Layout:
    """Return a random scene.

    Args:
        troupe: People to draw from.
        size: Width and height of the image [px].
        focal_px: Focal length [px].
        rng: Randomness.
    """
    distance_m = rng.uniform(*DISTANCE_M) if rng.random() < 0.5 else rng.uniform(1.2, 3.6)
    camera, T_camera_room = _draw_camera(size, focal_px, distance_m, rng)
    eye = invert_transform(T_camera_room)[:3, 3]
    room = _draw_room(distance_m, float(eye[1]), rng)
    actors = _draw_people(troupe, room, distance_m, eye, rng)
    clutter = draw_clutter(room, rng, int(rng.integers(0, 6))) if _walled(room) else ()
    seats = tuple(block for actor in actors for block in actor.seat)
    things = _draw_things(room, actors, eye, rng)
    carried = tuple(draw_prop(troupe.model, actor.parameters, rng)
                    for actor in actors if rng.random() < PROP_SHARE)
    blocks = clutter + seats + things + carried
    return Layout(room, actors, blocks, camera, T_camera_room, np.zeros(3))


def _draw_camera(
    size: tuple[int, int], focal_px: float, distance_m: float, rng: np.random.Generator
) -> tuple[Camera, Float[np.ndarray, '4 4']]:
    """Return a camera above the origin that looks along -z at about the height of people."""
    width, height = size
    fx = focal_px * rng.uniform(1 - FOCAL_JITTER, 1 + FOCAL_JITTER)
    centre = (np.array(size) - 1) / 2 + rng.normal(0, CENTRE_JITTER / 2, 2) * size
    camera = Camera(width, height, fx, fx, float(centre[0]), float(centre[1]))
    high = rng.uniform(*HEIGHT_M) if rng.random() < 0.5 else rng.normal(1.3, 0.25)
    eye = np.array([0.0, max(float(high), 0.3), 0.0])
    aim = np.array([rng.normal(0, 0.15 * distance_m), rng.normal(0.85, 0.3), -distance_m])
    roll = np.deg2rad(np.clip(rng.normal(0, ROLL_DEG / 2), -ROLL_DEG, ROLL_DEG))
    return camera, look_at(eye, aim, float(roll))


def _draw_room(distance_m: float, eye_height_m: float, rng: np.random.Generator) -> Room:
    """Return a room around the camera: a chamber, a hall, or ground without walls."""
    back = distance_m + (rng.uniform(0.5, 2.0) if rng.random() < 0.6 else rng.uniform(1.0, 9.0))
    width = rng.uniform(1.5, 3.5) if rng.random() < 0.7 else rng.uniform(2.0, 9.0)
    height = max(rng.uniform(2.3, 3.2) if rng.random() < 0.8 else rng.uniform(3.0, 6.0),
                 eye_height_m + 0.3)
    if rng.random() < 0.08:
        back, width, height = np.inf, np.inf, np.inf
    grey = np.full(3, 0.5)
    return Room(width, back, 1.0, height, grey, grey, Texture.PLAIN)


def _walled(room: Room) -> bool:
    return bool(np.isfinite(room.back_m))


def _draw_people(
    troupe: Troupe, room: Room, distance_m: float, eye: Float[np.ndarray, '3'],
    rng: np.random.Generator,
) -> tuple[Actor, ...]:
    """Return people before the camera whose boxes keep clear of each other and of the walls."""
    actors: list[Actor] = []
    for k in range(int(rng.choice(len(COUNT_SHARES), p=COUNT_SHARES))):
        somebody = troupe.draw(rng)
        yaw = rng.normal(0, 0.9) if rng.random() < 0.6 else rng.uniform(-np.pi, np.pi)
        for _ in range(TRIES):
            far = distance_m if k == 0 else np.clip(
                distance_m + rng.normal(0, 1.0), 0.8, DISTANCE_M[1] + 1.0)
            place = np.array([rng.normal(0, 0.22) * far, 0.0, -far])
            if actors and rng.random() < BEHIND_SHARE:
                before = actors[int(rng.integers(len(actors)))].surface.mean(axis=0)
                place = before * rng.uniform(1.1, 1.7)
                place[0] += rng.normal(0, 0.25)
                place[1] = 0.0
            placed = actor_at(somebody, troupe.model, place, float(yaw))
            if _fits(placed, actors, room, eye):
                actors.append(placed)
                break
    return tuple(actors)


def _fits(
    actor: Actor, others: Sequence[Actor], room: Room, eye: Float[np.ndarray, '3']
) -> bool:
    low, high = actor.surface.min(axis=0), actor.surface.max(axis=0)
    if low[0] < -room.half_width_m or high[0] > room.half_width_m or low[2] < -room.back_m:
        return False
    if np.linalg.norm(np.clip(eye, low, high) - eye) < EYE_GAP_M:
        return False
    for other in others:
        gap = np.maximum(low - other.surface.max(axis=0), other.surface.min(axis=0) - high)
        if gap[[0, 2]].max() < SIDE_GAP_M:
            return False
    return True


def _draw_things(
    room: Room, actors: Sequence[Actor], eye: Float[np.ndarray, '3'], rng: np.random.Generator
) -> tuple[Block, ...]:
    """Return furniture before people and anywhere else, clear of people and of the camera."""
    kept: tuple[Block, ...] = ()
    occluders = int(rng.integers(1, 3)) if actors and rng.random() < OCCLUDED_SHARE else 0
    for k in range(occluders + int(rng.integers(0, 7))):
        if k < occluders:
            thing = before_person(actors[int(rng.integers(len(actors)))], eye, rng)
        else:
            far = rng.uniform(1.1, min(room.back_m, 8.0))
            place = np.array([rng.normal(0, 0.4) * far, 0.0, -far])
            thing = moved(draw_thing(rng), place, float(rng.uniform(-np.pi, np.pi)))
        if not any(_in_the_way(block, actors, eye) for block in thing):
            kept += thing
    return kept


def _in_the_way(
    block: Block, actors: Sequence[Actor], eye: Float[np.ndarray, '3']
) -> bool:
    if depth_inside(block, eye[None])[0] > -EYE_GAP_M / 2:
        return True
    near = [actor.surface[::8] for actor in actors if is_near(block, actor.surface[::8])]
    return any(depth_inside(block, points).max() > 0.0 for points in near)
