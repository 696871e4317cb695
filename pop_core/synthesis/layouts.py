"""Who and what stands where in a scene, before anything is rendered (room frame, [m])."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel
from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import invert_transform
from pop_core.synthesis.blocks import Block, block_surface, depth_inside, moved
from pop_core.synthesis.cameras import CameraRange, draw_camera
from pop_core.synthesis.occluders import OCCLUDERS
from pop_core.synthesis.people import Actor, actor_at, draw_actor
from pop_core.synthesis.rooms import Room, draw_clutter, draw_room
from pop_core.synthesis.shading import joined

PEOPLE_GAP_M = 0.06
CAMERA_GAP_M = 0.35


@dataclass(frozen=True, slots=True)
class SceneConfig:
    """What scenes are drawn from.

    Args:
        people: Fewest and most people.
        pose_shares: Kind of pose and its share.
        hidden_share: Lowest and highest share of hidden joints of the most hidden person.
        occluders: Fewest and most things put between camera and people.
        clutter: Most things along the walls.
        child_share: Share of children.
        bare_share: Share of people without clothes, whose T-pose can be compared with truth.
        sensors: Presets of sensor noise, one drawn per scene; empty leaves depth perfect.
        cameras: What cameras are drawn from.
    """

    people: tuple[int, int] = (1, 3)
    pose_shares: tuple[tuple[str, float], ...] = (
        ('standing', 0.2), ('motion', 0.2), ('walking', 0.1), ('seated', 0.22),
        ('reaching', 0.1), ('bending', 0.06), ('crouching', 0.07), ('lying', 0.05))
    hidden_share: tuple[float, float] = (0.2, 0.6)
    occluders: tuple[int, int] = (1, 2)
    clutter: int = 5
    child_share: float = 0.1
    bare_share: float = 0.25
    sensors: tuple[str, ...] = ('structured_light', 'stereo', 'time_of_flight')
    cameras: CameraRange = field(default_factory=CameraRange)


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
    if not _free(clutter, actors, eye) or _too_near(actors, eye):
        return None
    occluders = _draw_occluders(model, actors, eye, config, rng)
    if occluders is None:
        return None
    light = np.array([rng.uniform(-1.5, 1.5), room.height_m - 0.2, rng.uniform(0.0, 2.5)])
    return Layout(room, actors, fixed + occluders, camera, T_camera_room, light)


def hidden_from(
    eye: Float[np.ndarray, '3'], p_room: Float[np.ndarray, 'n 3'],
    vertices: Float[np.ndarray, 'v 3'], faces: Int[np.ndarray, 'm 3'],
) -> Bool[np.ndarray, 'n']:
    """Return which points a set of triangles hides from an eye (Moeller and Trumbore 1997)."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    e1, e2, s = b - a, c - a, eye - a
    q = np.cross(s, e1)
    hidden = np.zeros(len(p_room), dtype=bool)
    for i, ray in enumerate(p_room - eye):
        h = np.cross(ray, e2)
        determinant = (e1 * h).sum(axis=1)
        with np.errstate(divide='ignore', invalid='ignore'):
            u = (s * h).sum(axis=1) / determinant
            v = (q @ ray) / determinant
            t = (e2 * q).sum(axis=1) / determinant
        hidden[i] = bool(np.any((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)))
    return hidden


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
    near, _ = cKDTree(second.surface[::6]).query(first.surface[::6])
    in_seat = any(depth_inside(block, second.surface).max() > 0 for block in first.seat)
    in_other = any(depth_inside(block, first.surface).max() > 0 for block in second.seat)
    return bool(near.min() > PEOPLE_GAP_M and not in_seat and not in_other)


def _draw_occluders(
    model: BodyModel, actors: Sequence[Actor], eye: Float[np.ndarray, '3'], config: SceneConfig,
    rng: np.random.Generator,
) -> tuple[Block, ...] | None:
    """Return furniture that hides the wanted share of some person's joints, or None."""
    if not actors:
        return ()
    low, high = config.hidden_share
    for _ in range(25):
        blocks: tuple[Block, ...] = ()
        for _ in range(rng.integers(config.occluders[0], config.occluders[1] + 1)):
            thing = _before(actors[int(rng.integers(len(actors)))], eye, rng)
            blocks = blocks if _touch(blocks, thing) else blocks + thing
        if not _free(blocks, actors, eye):
            continue
        shares = _hidden_shares(model, actors, blocks, eye)
        # The body itself hides joints too: leave room for them below the upper bound.
        if max(shares) <= high and (low == 0 or max(shares) >= 0.6 * low):
            return blocks
    return None


def _before(
    victim: Actor, eye: Float[np.ndarray, '3'], rng: np.random.Generator
) -> tuple[Block, ...]:
    """Return a piece of furniture on the floor between the eye and a person."""
    thing = OCCLUDERS[rng.integers(len(OCCLUDERS))](rng)
    middle = victim.skin.mean(axis=0)
    share = rng.uniform(0.12, 0.55)
    place = middle + share * (eye - middle) + np.array([rng.normal(0, 0.3), 0.0, 0.0])
    place[1] = 0.0
    toward = eye - middle
    yaw = np.arctan2(toward[0], toward[2]) + rng.normal(0, 0.3)
    if rng.random() < 0.3:
        yaw += np.pi
    return moved(thing, place, float(yaw))


def _touch(first: Sequence[Block], second: Sequence[Block]) -> bool:
    """Return whether two pieces of furniture run into each other."""
    pairs = ((first, second), (second, first))
    return any(
        depth_inside(block, block_surface(other).vertices).max() > 0
        for these, those in pairs for block in these for other in those)


def _hidden_shares(
    model: BodyModel, actors: Sequence[Actor], blocks: Sequence[Block],
    eye: Float[np.ndarray, '3'],
) -> list[float]:
    """Return per person the share of joints that furniture or other people hide."""
    things = joined([block_surface(block) for block in blocks]) if blocks else None
    shares = []
    for k, actor in enumerate(actors):
        p = joints(model, actor.parameters)
        hidden = np.zeros(len(p), dtype=bool)
        if things is not None:
            hidden |= hidden_from(eye, p, things.vertices, things.faces)
        for other in (*actors[:k], *actors[k + 1:]):
            hidden |= hidden_from(eye, p, other.skin[model.fit_vertices], model.fit_faces)
        shares.append(float(hidden.mean()))
    return shares


def _free(
    blocks: Sequence[Block], actors: Sequence[Actor], eye: Float[np.ndarray, '3']
) -> bool:
    """Return whether blocks keep clear of people and of the camera."""
    for block in blocks:
        if depth_inside(block, eye[None])[0] > -CAMERA_GAP_M:
            return False
        if any(depth_inside(block, actor.surface).max() > -0.005 for actor in actors):
            return False
    return True


def _too_near(actors: Sequence[Actor], eye: Float[np.ndarray, '3']) -> bool:
    return any(np.linalg.norm(actor.skin - eye, axis=1).min() < 0.5 for actor in actors)
