"""Postures: where pelvis, spine and legs are, from standing to lying (upright frame, rad, m).

Each function draws one batch of figures. Numbers are ranges of uniform draws, chosen by looking at
the pictures of `pop library sample`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.procedural.figures import SIDES, Figures
from pop_core.retrieval.procedural.limbs import normalised

FORWARD = np.array([0.0, 0.0, 1.0])
DOWN = np.array([0.0, -1.0, 0.0])
Draw = np.random.Generator
Posture = Callable[[Figures, Draw], None]


def vectors(
    x: Float[np.ndarray, '*n'] | float, y: Float[np.ndarray, '*n'] | float,
    z: Float[np.ndarray, '*n'] | float,
) -> Float[np.ndarray, '*n 3']:
    """Return vectors of components that are one number for all or one number per figure."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1).astype(np.float64)


def lean(figures: Figures, rng: Draw, pitch: tuple[float, float], spine: tuple[float, float],
         *, side: float = 0.08, turn: float = 0.25) -> None:
    """Draw the pelvis' pitch and the spine's bend forward, to the side and about itself."""
    n = figures.n
    figures.tilt = vectors(
        rng.uniform(*pitch, n), rng.normal(0, 0.05, n), rng.normal(0, side, n))
    figures.bend_spine(vectors(
        rng.uniform(*spine, n), rng.normal(0, turn, n), rng.normal(0, 1.5 * side, n)))


def direction(
    pitch: Float[np.ndarray, 'n'], yaw: Float[np.ndarray, 'n']
) -> Float[np.ndarray, 'n 3']:
    """Return unit vectors raised by `pitch` from straight down about +x towards +z, turned by yaw.

    Pitch 0 points down, pi/2 forward, pi up; yaw turns towards +x, the person's left.
    """
    forward = np.sin(pitch)
    return vectors(forward * np.sin(yaw), -np.cos(pitch), forward * np.cos(yaw))


def standing(figures: Figures, rng: Draw) -> None:
    """Feet apart, weight anywhere, knees nearly straight."""
    lean(figures, rng, (-0.1, 0.15), (-0.1, 0.3))
    n, leg = figures.n, leg_length(figures)
    height = leg * rng.uniform(0.93, 1.0, n)
    shift, width = rng.normal(0, 0.05, n), rng.uniform(0.08, 0.42, n)
    for side, sign in SIDES.items():
        stagger = rng.normal(0, 0.08, n)
        ankle = vectors(sign * 0.5 * width + shift, -height, stagger)
        stand_on(figures, side, rng, ankle, toe_out=rng.normal(0.2, 0.2, n))


def walking(figures: Figures, rng: Draw) -> None:
    """Any moment of a walk or a run."""
    n = figures.n
    speed = rng.uniform(0.3, 1.3, n)
    lean(figures, rng, (-0.02, 0.2), (0.0, 0.25), turn=0.2)
    phase = rng.uniform(0, 2 * np.pi, n)
    for side, offset in (('left', 0.0), ('right', np.pi)):
        swing = np.sin(phase + offset)
        lift = np.clip(np.cos(phase + offset), 0, None) * speed
        pitch = 0.5 * speed * swing + 0.45 * lift * rng.uniform(0.5, 1.2, n)
        bend = 0.12 + 1.0 * lift + 0.15 * speed * np.clip(-swing, 0, None)
        sign = SIDES[side]
        yaw = np.zeros(n)
        figures.set_leg(
            side, normalised(direction(pitch, yaw) + vectors(0.04 * sign, 0.0, 0.0)),
            direction(pitch - bend, yaw), np.tile(FORWARD, (n, 1)))
        figures.aim_foot(side, vectors(
            np.clip(bend - pitch, -0.4, 0.9), sign * rng.normal(0.1, 0.1, n), 0.0))


def sitting(figures: Figures, rng: Draw) -> None:
    """On chairs, stools and sofas: upright, slumped or leaning forward; legs independent."""
    n = figures.n
    slump = rng.uniform(-0.65, 0.35, n)
    figures.tilt = vectors(slump, rng.normal(0, 0.08, n), rng.normal(0, 0.06, n))
    bend = rng.uniform(-0.1, 0.75, n) - 0.35 * np.minimum(slump, 0)
    figures.bend_spine(vectors(bend, rng.normal(0, 0.25, n), rng.normal(0, 0.12, n)))
    seat, reach, spread = (rng.normal(0, sigma, n) for sigma in (0.16, 0.3, 0.2))
    for side, sign in SIDES.items():
        # Low sofas raise the knees, high stools lower them; a slumped pelvis slides forward.
        pitch = 0.5 * np.pi + 0.06 + seat + rng.normal(0, 0.09, n)
        yaw = sign * np.clip(0.12 + spread + rng.normal(0, 0.18, n), -0.25, 0.95)
        shin_pitch = np.clip(reach + rng.normal(0, 0.3, n), -0.8, 1.25)
        shin_yaw = yaw * rng.uniform(-0.3, 1.2, n) + rng.normal(0, 0.15, n)
        sit_leg(figures, side, rng, direction(pitch, yaw), direction(shin_pitch, shin_yaw))


def sitting_crossed(figures: Figures, rng: Draw) -> None:
    """Seated with one leg over the other, knee on knee or ankle on knee."""
    sitting(figures, rng)
    n = figures.n
    figure_four = rng.random(n) < 0.5
    # Knee on knee: the thigh over the other, the shin hanging down outside it.
    thigh = direction(rng.uniform(1.75, 2.0, n), rng.uniform(-0.3, -0.1, n))
    shin = direction(rng.uniform(0.0, 0.7, n), rng.uniform(-0.9, -0.2, n))
    # Ankle on knee: the thigh out, the shin lying across.
    open_thigh = direction(rng.uniform(1.5, 1.75, n), rng.uniform(0.5, 0.95, n))
    across = normalised(vectors(
        rng.uniform(-1.0, -0.8, n), rng.uniform(-0.25, 0.1, n), rng.uniform(-0.1, 0.35, n)))
    sit_leg(
        figures, 'left', rng, np.where(figure_four[:, None], open_thigh, thigh),
        np.where(figure_four[:, None], across, shin))


def floor_sitting(figures: Figures, rng: Draw) -> None:
    """On the floor: legs stretched, knees drawn up, or crossed."""
    n = figures.n
    figures.tilt = vectors(
        rng.uniform(-0.7, 0.15, n), rng.normal(0, 0.1, n), rng.normal(0, 0.08, n))
    figures.bend_spine(vectors(
        rng.uniform(0.0, 0.9, n), rng.normal(0, 0.25, n), rng.normal(0, 0.12, n)))
    kind = rng.integers(0, 3, n)
    for side, sign in SIDES.items():
        mixed = np.where(rng.random(n) < 0.25, rng.integers(0, 2, n), kind)
        yaw = sign * rng.uniform(-0.05, 0.5, n)
        stretched = direction(0.5 * np.pi + rng.uniform(0.0, 0.15, n), yaw)
        drawn_up = direction(rng.uniform(2.0, 2.75, n), yaw)
        crossed = direction(rng.uniform(1.6, 1.95, n), sign * rng.uniform(0.6, 1.0, n))
        thigh = np.choose(mixed[:, None], [stretched, drawn_up, crossed])
        shin = np.choose(mixed[:, None], [
            direction(0.5 * np.pi - rng.uniform(0.0, 0.3, n), yaw),
            direction(rng.uniform(-0.1, 0.8, n), yaw),
            normalised(vectors(
                -sign * rng.uniform(0.6, 1.0, n), rng.uniform(-0.6, -0.2, n),
                rng.uniform(-0.5, 0.3, n)))])
        sit_leg(figures, side, rng, thigh, shin)


def crouching(figures: Figures, rng: Draw) -> None:
    """Half and full squats, feet flat or on the toes."""
    n, leg = figures.n, leg_length(figures)
    depth = rng.uniform(0.35, 0.92, n)
    lean(figures, rng, (0.0, 0.7), (0.1, 0.8), turn=0.25)
    width = rng.uniform(0.12, 0.6, n)
    for side, sign in SIDES.items():
        ankle = vectors(
            sign * 0.5 * width, -leg * depth, rng.uniform(-0.15, 0.2, n))
        pole = vectors(sign * rng.uniform(0.0, 0.7, n), 0.2, 1.0)
        figures.reach_leg(side, ankle, pole)
        figures.aim_foot(side, vectors(
            rng.uniform(0.0, 0.5, n), sign * rng.uniform(0.0, 0.5, n), 0.0))


def kneeling(figures: Figures, rng: Draw) -> None:
    """On both knees, upright or sitting on the heels."""
    n = figures.n
    lean(figures, rng, (-0.1, 0.5), (-0.1, 0.7))
    low = np.where(rng.random(n) < 0.5, rng.uniform(0.7, 1.02, n), rng.uniform(-0.1, 0.6, n))
    for side, sign in SIDES.items():
        thigh = direction(low + rng.normal(0, 0.05, n), sign * rng.uniform(0.0, 0.4, n))
        shin = direction(np.full(n, -0.5 * np.pi) + rng.normal(0, 0.08, n), np.zeros(n))
        figures.set_leg(side, thigh, shin, np.tile(FORWARD, (n, 1)))
        figures.aim_foot(side, vectors(rng.uniform(0.9, 1.5, n), 0.0, 0.0))


def half_kneeling(figures: Figures, rng: Draw) -> None:
    """One knee on the floor, the other foot in front; lunges."""
    n = figures.n
    lean(figures, rng, (-0.1, 0.4), (-0.1, 0.6))
    front = rng.uniform(1.1, 1.75, n)
    figures.set_leg(
        'left', direction(front, rng.uniform(-0.1, 0.6, n)),
        direction(rng.uniform(-0.4, 0.35, n), rng.uniform(-0.1, 0.3, n)),
        np.tile(FORWARD, (n, 1)))
    back = rng.uniform(-0.5, 0.25, n)
    figures.set_leg(
        'right', direction(back, np.zeros(n)),
        direction(-rng.uniform(0.9, 1.7, n), np.zeros(n)), np.tile(FORWARD, (n, 1)))
    level_foot(figures, 'left', rng)
    figures.aim_foot('right', vectors(rng.uniform(0.6, 1.3, n), 0.0, 0.0))


def bending(figures: Figures, rng: Draw) -> None:
    """Bent forward at hips and spine, to the floor or over a table, knees soft."""
    n, leg = figures.n, leg_length(figures)
    lean(figures, rng, (0.25, 1.25), (0.2, 1.1), turn=0.3)
    pitch = figures.tilt[:, 0]
    for side, sign in SIDES.items():
        ankle = vectors(
            sign * rng.uniform(0.05, 0.25, n), -leg * rng.uniform(0.72, 0.99, n),
            0.18 * np.sin(pitch) + rng.normal(0, 0.1, n))
        stand_on(figures, side, rng, ankle, toe_out=rng.normal(0.15, 0.15, n))


def climbing(figures: Figures, rng: Draw) -> None:
    """One foot high on a step, ladder or wall, or one leg raised and kicking."""
    n, leg = figures.n, leg_length(figures)
    lean(figures, rng, (-0.15, 0.45), (-0.15, 0.5))
    ankle = vectors(0.12 + rng.normal(0, 0.05, n), -leg * rng.uniform(0.35, 0.8, n),
                    rng.uniform(0.05, 0.55, n))
    figures.reach_leg('left', ankle, vectors(rng.uniform(-0.1, 0.6, n), 0.3, 1.0))
    level_foot(figures, 'left', rng)
    stand = vectors(-0.1 + rng.normal(0, 0.05, n), -leg * rng.uniform(0.9, 0.99, n),
                    rng.uniform(-0.3, 0.1, n))
    stand_on(figures, 'right', rng, stand, toe_out=rng.normal(0.15, 0.15, n))


def lying(figures: Figures, rng: Draw) -> None:
    """On the back, the belly or a side, legs stretched or drawn up."""
    n = figures.n
    roll = rng.choice([0.0, np.pi, 0.5 * np.pi], n, p=[0.5, 0.2, 0.3]) + rng.normal(0, 0.2, n)
    curl = rng.uniform(0.0, 1.0, n)
    figures.bend_spine(vectors(
        rng.uniform(-0.15, 0.3, n) + 0.3 * curl, rng.normal(0, 0.2, n), rng.normal(0, 0.12, n)))
    for side, sign in SIDES.items():
        fold = np.where(rng.random(n) < 0.5, rng.uniform(0, 0.25, n), rng.uniform(0.2, 2.2, n))
        thigh_pitch = fold * rng.uniform(0.4, 0.9, n) * np.where(np.cos(roll) < -0.5, 0.1, 1.0)
        yaw = sign * rng.uniform(-0.1, 0.6, n)
        thigh = normalised(direction(thigh_pitch, yaw) + vectors(0.1 * sign, 0.0, 0.0))
        figures.set_leg(
            side, thigh, direction(thigh_pitch - fold, yaw * rng.uniform(0, 1, n)),
            np.tile(FORWARD, (n, 1)))
        figures.turn_joint(f'{side}_ankle', vectors(rng.uniform(-0.1, 0.7, n), 0.0, 0.0))
    # The body is laid down whole: legs were drawn in the pelvis' own frame (tilt zero).
    figures.tilt = laid_down(roll)


def laid_down(roll: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'n 3']:
    """Return the pelvis' rotation vector: on the back, feet towards +z, rolled about the spine."""
    back = from_rotvec(np.array([-0.5 * np.pi, 0.0, 0.0]))
    return to_rotvec(back @ from_rotvec(vectors(0.0, roll, 0.0)))


def leg_length(figures: Figures) -> float:
    """Return the length of the straight leg, hip to ankle [m]."""
    return figures.length('left_knee', 'left_hip') + figures.length('left_ankle', 'left_knee')


def stand_on(
    figures: Figures, side: str, rng: Draw, ankle: Float[np.ndarray, 'n 3'],
    toe_out: Float[np.ndarray, 'n'],
) -> None:
    """Put a foot flat on the ground, knee over the toes."""
    sign = SIDES[side]
    pole = vectors(sign * np.sin(toe_out), 0.0, np.cos(toe_out))
    figures.reach_leg(side, ankle, pole + rng.normal(0, 0.05, (figures.n, 3)))
    figures.aim_foot(side, vectors(0.0, sign * toe_out, 0.0))


def sit_leg(
    figures: Figures, side: str, rng: Draw, thigh: Float[np.ndarray, 'n 3'],
    shin: Float[np.ndarray, 'n 3'],
) -> None:
    """Point a seated leg's bones, knee up where it is straight, the foot near level."""
    pole = vectors(0.0, 1.0, 0.4) + rng.normal(0, 0.1, (figures.n, 3))
    figures.set_leg(side, thigh, shin, pole)
    level_foot(figures, side, rng)


def level_foot(figures: Figures, side: str, rng: Draw) -> None:
    """Turn a foot to the floor with some freedom."""
    n = figures.n
    figures.aim_foot(side, vectors(
        rng.normal(0, 0.15, n), SIDES[side] * rng.normal(0.2, 0.25, n), 0.0))
