"""Clothes and hair as a smooth displacement of the skin along its normals, and their colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.joints import JOINT_INDEX, JOINT_NAMES
from pop_core.body.model import BodyModel
from pop_core.body.scalp import hair_share
from pop_core.rendering.depth_renderer import vertex_normals
from pop_core.synthesis.rooms import any_colour, varied

SKIN_COLOURS = ((0.86, 0.66, 0.54), (0.72, 0.50, 0.37), (0.50, 0.33, 0.23), (0.32, 0.20, 0.14))
HAIR_COLOURS = ((0.08, 0.06, 0.05), (0.25, 0.15, 0.08), (0.50, 0.36, 0.20), (0.45, 0.44, 0.42))
LONGEST_FOLD_M = 0.35
SHORTEST_FOLD_M = 0.10


@dataclass(frozen=True, slots=True, eq=False)
class Outfit:
    """What a person wears.

    Args:
        displacement_m: Distance of cloth or hair from the skin, per vertex [m].
        albedo: Reflectance per vertex.
    """

    displacement_m: Float[np.ndarray, 'v']
    albedo: Float[np.ndarray, 'v 3']


def draw_outfit(
    model: BodyModel, rng: np.random.Generator, thickest_m: float = 0.04
) -> Outfit:
    """Return random clothes, 0 to `thickest_m` from the skin [m]."""
    sleeves, legs = rng.choice(['short', 'long']), rng.choice(['short', 'long'], p=[0.2, 0.8])
    top, bottom = thickest_m * rng.uniform([0.1, 0.1], [0.75, 0.6])
    thickness = np.zeros(len(JOINT_NAMES))
    _dress(thickness, _TORSO, top)
    _dress(thickness, _SLEEVES, top * 0.7 if sleeves == 'long' else 0.0)
    _dress(thickness, ('left_shoulder', 'right_shoulder'), top * 0.8)
    _dress(thickness, ('left_hip', 'right_hip'), bottom)
    _dress(thickness, ('left_knee', 'right_knee'), bottom if legs == 'long' else 0.0)
    _dress(thickness, _SHOES, thickest_m * 0.2)
    folds = 1.0 + 0.5 * smooth_noise(model.v_template, rng)
    displacement = (model.weights @ thickness) * folds
    hair = hair_share(model) * rng.uniform(0.0, 0.03)
    return Outfit(
        np.clip(displacement + hair, 0.0, thickest_m),
        _colours(model, sleeves == 'long', legs == 'long', rng))


def dressed(
    vertices: Float[np.ndarray, 'v 3'], f: Int[np.ndarray, 'm 3'], outfit: Outfit
) -> Float[np.ndarray, 'v 3']:
    """Return a posed body [m] with its clothes on."""
    return vertices + vertex_normals(vertices, f) * outfit.displacement_m[:, None]


def smooth_noise(
    p: Float[np.ndarray, 'n 3'], rng: np.random.Generator, waves: int = 8
) -> Float[np.ndarray, 'n']:
    """Return a smooth random field of unit amplitude over points [m], as a sum of plane waves."""
    directions = rng.normal(size=(waves, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lengths = rng.uniform(SHORTEST_FOLD_M, LONGEST_FOLD_M, waves)
    phases = p @ (directions * (2 * np.pi / lengths)[:, None]).T + rng.uniform(0, 2 * np.pi, waves)
    return np.sin(phases).mean(axis=1) * 2.0


_TORSO = ('pelvis', 'spine1', 'spine2', 'spine3', 'left_collar', 'right_collar')
_SLEEVES = ('left_elbow', 'right_elbow')
_SHOES = ('left_ankle', 'right_ankle', 'left_foot', 'right_foot')


def _dress(thickness: Float[np.ndarray, '24'], names: tuple[str, ...], thickness_m: float) -> None:
    thickness[[JOINT_INDEX[name] for name in names]] = thickness_m


def _colours(
    model: BodyModel, long_sleeves: bool, long_legs: bool, rng: np.random.Generator
) -> Float[np.ndarray, 'v 3']:
    """Return the colour of each vertex: the bone that moves it most says what it wears."""
    skin = varied(SKIN_COLOURS[rng.integers(len(SKIN_COLOURS))], rng)
    shirt, trousers = any_colour(rng), any_colour(rng) * 0.7
    bone_colour = np.tile(skin, (len(JOINT_NAMES), 1))
    upper = [*_TORSO, 'left_shoulder', 'right_shoulder', *(_SLEEVES if long_sleeves else ())]
    lower = ['left_hip', 'right_hip', *(('left_knee', 'right_knee') if long_legs else ())]
    for names, colour in ((upper, shirt), (lower, trousers), (_SHOES, any_colour(rng) * 0.4)):
        bone_colour[[JOINT_INDEX[name] for name in names]] = colour
    bone_colour[JOINT_INDEX['pelvis']] = trousers
    colours = bone_colour[model.weights.argmax(axis=1)]
    hair = varied(HAIR_COLOURS[rng.integers(len(HAIR_COLOURS))], rng)
    is_hair = hair_share(model)[:, None] > 0.5
    return np.where(is_hair, hair, colours)
