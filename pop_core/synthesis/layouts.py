"""Who and what stands where in a scene, before anything is rendered (room frame, [m])."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import cKDTree

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel
from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import invert_transform
from pop_core.synthesis.blocks import Block, depth_inside
from pop_core.synthesis.cameras import draw_camera
from pop_core.synthesis.occlusion import draw_occluders, is_free
from pop_core.synthesis.people import Actor, actor_at, draw_actor
from pop_core.synthesis.props import draw_prop
from pop_core.synthesis.rooms import Room, draw_clutter, draw_room
from pop_core.synthesis.scene_config import SceneConfig

PEOPLE_GAP_M = 0.06
WALL_GAP_M = 0.15


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    """A scene as objects.

    Args:
        room: Walls and floor.
        actors: People, with their seats.
        blocks: Everything else that is solid.
        camera: Intrinsics.
        T_camera_room: Camera from room.
        light_room: The lamp [m].
    """

    room: Room
    actors: tuple[Actor, ...]
    blocks: tuple[Block, ...]
    camera: Camera
    T_camera_room: Float[np.ndarray, '4 4']
    light_room: Float[np.ndarray, '3']


def draw_layout(
    model: BodyModel, config: SceneConfig, rng: np.random.Generator
) -> Layout | None:
    """Return a random layout, or None when what was drawn does not fit together."""
    room = draw_room(rng)
    actors = _draw_people(model, config, rng)
    if actors is None:
        return None
    target = _middle(model, actors)
    camera, T_camera_room = draw_camera(target, config.cameras, rng)
    eye = invert_transform(T_camera_room)[:3, 3]
    clutter = draw_clutter(room, rng, int(rng.integers(0, config.clutter + 1)))
    fixed = clutter + tuple(block for actor in actors for block in actor.seat)
    if not (_in_room(room, eye) and is_free(clutter, actors, eye)) or _too_near(actors, eye):
        return None
    occluders = draw_occluders(model, actors, eye, config, rng)
    if occluders is None:
        return None
    carried = tuple(
        draw_prop(model, actor.parameters, rng)
        for actor in actors if rng.random() < config.prop_share)
    light = np.array([rng.uniform(-1.5, 1.5), room.height_m - 0.2, rng.uniform(0.0, 2.5)])
    return Layout(room, actors, fixed + occluders + carried, camera, T_camera_room, light)


def _draw_people(
    model: BodyModel, config: SceneConfig, rng: np.random.Generator
) -> tuple[Actor, ...] | None:
    """Return people side by side and behind each other, none inside another, or None."""
    kinds, shares = zip(*config.pose_shares, strict=True)
    count = int(rng.integers(config.people[0], config.people[1] + 1))
    actors: list[Actor] = []
    for k in range(count):
        kind = str(rng.choice(kinds, p=np.array(shares) / sum(shares)))
        child, bare = rng.random(2) < [config.child_share, config.bare_share]
        actor = draw_actor(model, kind, rng, child=bool(child), bare=bool(bare))
        # Most people face the camera side, but backs are seen too.
        yaw = rng.normal(0, 0.9) if rng.random() < 0.75 else rng.uniform(-np.pi, np.pi)
        for _ in range(12):
            place = np.zeros(3)
            if k > 0:
                place = np.array([rng.uniform(-1.3, 1.3), 0.0, rng.uniform(-0.9, 0.9)])
            placed = actor_at(actor, model, place, float(yaw))
            if all(_apart(placed, other) for other in actors):
                actors.append(placed)
                break
        else:
            return None
    return tuple(actors)


def _middle(model: BodyModel, actors: Sequence[Actor]) -> Float[np.ndarray, '3']:
    """Return what the camera looks at [m]: the first person, or where one would stand."""
    if not actors:
        return np.array([0.0, 0.9, 0.0])
    return np.asarray(joints(model, actors[0].parameters).mean(axis=0))


def _apart(first: Actor, second: Actor) -> bool:
    """Return whether two people and their seats keep clear of each other."""
    a, b = first.surface, second.surface
    beside = np.maximum(a.min(axis=0) - b.max(axis=0), b.min(axis=0) - a.max(axis=0)).max()
    if beside > PEOPLE_GAP_M and not (first.seat or second.seat):
        return True
    near, _ = cKDTree(b[::6]).query(a[::6])
    in_seat = any(depth_inside(block, b).max() > 0 for block in first.seat)
    in_other = any(depth_inside(block, a).max() > 0 for block in second.seat)
    return bool(near.min() > PEOPLE_GAP_M and not in_seat and not in_other)


def _in_room(room: Room, eye: Float[np.ndarray, '3']) -> bool:
    beside = abs(eye[0]) < room.half_width_m - WALL_GAP_M
    return bool(beside and eye[1] < room.height_m - WALL_GAP_M and eye[2] < room.front_m)


def _too_near(actors: Sequence[Actor], eye: Float[np.ndarray, '3']) -> bool:
    return any(np.linalg.norm(actor.skin - eye, axis=1).min() < 0.5 for actor in actors)
