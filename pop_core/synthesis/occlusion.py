"""Furniture put between a camera and people so that it hides as much of them as wanted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.kinematics import joints
from pop_core.body.model import BodyModel
from pop_core.synthesis.blocks import Block, block_surface, depth_inside, is_near, moved
from pop_core.synthesis.occluders import OCCLUDERS
from pop_core.synthesis.people import Actor
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.shading import joined

CAMERA_GAP_M = 0.35


def draw_occluders(
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
            thing = before_person(actors[int(rng.integers(len(actors)))], eye, rng)
            blocks = blocks if _touch(blocks, thing) else blocks + thing
        if not is_free(blocks, actors, eye):
            continue
        if (low, high) == (0.0, 1.0):
            return blocks
        shares = _hidden_shares(model, actors, blocks, eye)
        # The body itself hides joints too: leave room for them below the upper bound.
        if 0.6 * low <= max(shares) <= high:
            return blocks
    return None


def before_person(
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


def is_free(
    blocks: Sequence[Block], actors: Sequence[Actor], eye: Float[np.ndarray, '3']
) -> bool:
    """Return whether blocks keep clear of people and of the camera."""
    for block in blocks:
        if depth_inside(block, eye[None])[0] > -CAMERA_GAP_M:
            return False
        close = [actor.surface for actor in actors if is_near(block, actor.surface)]
        if any(depth_inside(block, surface).max() > -0.005 for surface in close):
            return False
    return True


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
            met = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < 1)
        hidden[i] = bool(met.any())
    return hidden
