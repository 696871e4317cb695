"""A short recording of one person who walks along behind a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.synthesis.blocks import Block, moved
from pop_core.synthesis.cameras import CameraRange, draw_camera
from pop_core.synthesis.clothes import Outfit, draw_outfit, dressed
from pop_core.synthesis.layouts import Layout
from pop_core.synthesis.occluders import bare_table
from pop_core.synthesis.people import Actor, actor_at
from pop_core.synthesis.poses import walking_pose
from pop_core.synthesis.rooms import draw_clutter, draw_room
from pop_core.synthesis.scenes import SyntheticScene, photograph
from pop_core.synthesis.truth import render_truth

STEP_PAIR_S = 1.1
STEP_PAIR_M = 1.25
CAMERA = CameraRange(
    focal=(0.82, 0.86), distance_m=(2.9, 3.0), height_m=(1.35, 1.45), aim_m=0.02, roll_deg=0.5)


def synthesise_sequence(
    model: BodyModel, seed: int, n_frames: int, *, rate_hz: float = 15.0,
    sensor: str = 'structured_light', start_ns: int = 1_700_000_000_000_000_000,
    progress: Callable[[int], None] | None = None,
) -> list[SyntheticScene]:
    """Return frames of a walk from the left of the image to the right, legs behind a table.

    Args:
        model: Body model.
        seed: Draws person, room, table and noise.
        n_frames: Number of frames.
        rate_hz: Frames per second.
        sensor: Noise preset, '' for none.
        start_ns: Stamp of the first frame [ns].
        progress: Called with the number of finished frames.
    """
    rng = np.random.default_rng([seed, 3])
    stage, outfit, betas = _draw_stage(model, rng)
    scenes = []
    for k in range(n_frames):
        seconds = k / rate_hz
        middle = (n_frames - 1) / 2 / rate_hz
        along = (seconds - middle) * STEP_PAIR_M / STEP_PAIR_S
        phase = 2 * np.pi * seconds / STEP_PAIR_S
        actor = _walker(model, betas, outfit, phase, along)
        layout = replace(stage, actors=(actor,))
        stamp = start_ns + round(k * 1e9 / rate_hz)
        truth = render_truth(model, layout)
        scenes.append(photograph(
            model, layout, truth, sensor=sensor, seed=seed * 100_003 + k, stamp_ns=stamp))
        if progress is not None:
            progress(k + 1)
    return scenes


def _draw_stage(
    model: BodyModel, rng: np.random.Generator
) -> tuple[Layout, Outfit, Float[np.ndarray, 'b']]:
    """Return the room without the person, and what the person looks like."""
    room = replace(draw_room(rng), half_width_m=3.2, back_m=1.6)
    camera, T_camera_room = draw_camera(np.array([0.0, 0.95, 0.0]), CAMERA, rng)
    desk: tuple[Block, ...] = moved(
        bare_table(1.5, 0.7, 0.74, rng), np.array([0.0, 0.0, 0.75]), 0.0)
    lamp = np.array([-1.0, room.height_m - 0.2, 1.8])
    blocks = desk + draw_clutter(room, rng, 3)
    betas = np.clip(rng.normal(size=model.n_betas), -1.2, 1.2)
    return Layout(room, (), blocks, camera, T_camera_room, lamp), draw_outfit(model, rng), betas


def _walker(
    model: BodyModel, betas: Float[np.ndarray, 'b'], outfit: Outfit, phase: float, along_m: float
) -> Actor:
    """Return the person at a moment of the walk, feet on the floor, heading along +x."""
    pose = walking_pose(model, phase, stride=0.9)
    parameters = BodyParameters(np.zeros(3), np.zeros(3), pose, betas)
    skin = vertices(model, parameters)
    lift = np.array([0.0, -skin[:, 1].min(), 0.0])
    skin = skin + lift
    actor = Actor(parameters.replaced(transl=lift), skin, dressed(skin, model.f, outfit), outfit,
                  (), 'walking')
    return actor_at(actor, model, np.array([along_m, 0.0, 0.0]), np.pi / 2 - 0.35)
