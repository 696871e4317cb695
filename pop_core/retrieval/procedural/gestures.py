"""Gestures: what the arms do, drawn in the chest's frame or towards places of the body [m, rad].

Each function sets one arm of a batch of figures whose trunk and legs stand already; gestures of
both arms together share their draws through a seed taken from the batch's generator.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from pop_core.retrieval.procedural.figures import SIDES, Figures
from pop_core.retrieval.procedural.limbs import normalised, turned
from pop_core.retrieval.procedural.postures import vectors

Draw = np.random.Generator
Gesture = Callable[[Figures, str, Draw], None]


def outward_pole(figures: Figures, sign: float, rng: Draw) -> Float[np.ndarray, 'n 3']:
    """Return where elbows point by default: down, outward and a little back."""
    n = figures.n
    return vectors(
        sign * rng.uniform(0.2, 1.0, n), rng.uniform(-1.0, -0.3, n), rng.uniform(-0.8, 0.1, n))


def raise_collar(figures: Figures, side: str, height: Float[np.ndarray, 'n'],
                 forward: Float[np.ndarray, 'n']) -> None:
    """Let the collar follow the arm: a third of what it rises and comes forward."""
    sign = SIDES[side]
    up = np.clip(0.3 * height, -0.1, 0.45)
    figures.turn_joint(f'{side}_collar', vectors(
        0.0, -sign * np.clip(0.25 * forward, -0.2, 0.3), sign * up))


def hanging(figures: Figures, side: str, rng: Draw) -> None:
    """Hanging by the side, also in the vertical when the trunk leans."""
    n, sign = figures.n, SIDES[side]
    R, _ = figures.chest()
    down = np.einsum('nrc,r->nc', R, np.array([0.0, -1.0, 0.0]))
    mix = rng.uniform(0, 1, (n, 1))
    base = normalised(mix * down + (1 - mix) * np.array([0.0, -1.0, 0.0]))
    upper = normalised(base + vectors(
        sign * rng.uniform(0.05, 0.4, n), 0.0, rng.normal(-0.05, 0.15, n)))
    forearm = normalised(upper + vectors(
        sign * rng.normal(-0.12, 0.12, n), 0.0, rng.uniform(0.05, 0.7, n)))
    raise_collar(figures, side, rng.normal(-0.1, 0.1, n), rng.normal(0, 0.1, n))
    figures.set_arm(side, upper, forearm, vectors(sign * 0.3, 0.0, np.full(n, -1.0)))


def reaching(figures: Figures, side: str, rng: Draw) -> None:
    """Anywhere a hand can go."""
    n, sign = figures.n, SIDES[side]
    aim = normalised(rng.normal(size=(n, 3)) * [1.0, 1.0, 1.0] + vectors(sign * 0.35, 0.0, 0.55))
    raise_collar(figures, side, np.clip(aim[:, 1], 0, None), aim[:, 2])
    distance = rng.uniform(0.45, 1.0, (n, 1)) * arm_length(figures)
    wrist = figures.shoulder(side) + aim * distance
    figures.reach_arm(side, wrist, outward_pole(figures, sign, rng))


def pointing(figures: Figures, side: str, rng: Draw) -> None:
    """A nearly straight arm to the front, the side or up."""
    n, sign = figures.n, SIDES[side]
    height, yaw = rng.uniform(-0.9, 1.0, n), rng.uniform(-0.7, 1.7, n)
    aim = vectors(
        sign * np.cos(height) * np.sin(yaw), np.sin(height), np.cos(height) * np.cos(yaw))
    raise_collar(figures, side, np.clip(aim[:, 1], 0, None), aim[:, 2])
    wrist = figures.shoulder(side) + aim * rng.uniform(0.85, 1.0, (n, 1)) * arm_length(figures)
    figures.reach_arm(side, wrist, outward_pole(figures, sign, rng))


def overhead(figures: Figures, side: str, rng: Draw) -> None:
    """Hands above the head or the shoulders, waving, lifting, hanging on."""
    n, sign = figures.n, SIDES[side]
    raise_collar(figures, side, rng.uniform(0.7, 1.4, n), rng.normal(0, 0.2, n))
    aim = normalised(vectors(
        sign * rng.uniform(-0.45, 0.6, n), 1.0, rng.uniform(-0.3, 0.6, n)))
    wrist = figures.shoulder(side) + aim * rng.uniform(0.6, 1.0, (n, 1)) * arm_length(figures)
    figures.reach_arm(side, wrist, vectors(
        sign * rng.uniform(0.5, 1.2, n), rng.uniform(-0.3, 0.3, n), rng.uniform(-0.3, 0.6, n)))


def on_thigh(figures: Figures, side: str, rng: Draw) -> None:
    """A hand resting on the thigh or the knee of its side, or in the lap."""
    n, sign = figures.n, SIDES[side]
    share = rng.uniform(0.3, 1.05, (n, 1))
    hip, knee = figures.hip(side), figures.knee(side)
    place = hip + share * (knee - hip) + vectors(
        -sign * rng.uniform(-0.06, 0.12, n), rng.uniform(0.08, 0.14, n), rng.normal(0, 0.02, n))
    raise_collar(figures, side, rng.normal(-0.1, 0.1, n), rng.normal(0.2, 0.1, n))
    figures.reach_arm(side, figures.in_chest(place), outward_pole(figures, sign, rng))


def in_front(figures: Figures, side: str, rng: Draw) -> None:
    """Hands held before the trunk: carrying, typing, holding a phone, praying."""
    n, sign = figures.n, SIDES[side]
    shared = np.random.default_rng(_shared_seed(figures))  # both hands hold the same thing
    height, depth = shared.uniform(-0.35, 0.12, n), shared.uniform(0.18, 0.42, n)
    half_width = shared.uniform(0.02, 0.25, n)
    place = vectors(
        sign * half_width, height + rng.normal(0, 0.03, n), depth + rng.normal(0, 0.03, n))
    raise_collar(figures, side, np.zeros(n), rng.uniform(0, 0.6, n))
    figures.reach_arm(side, place, outward_pole(figures, sign, rng))


def crossed(figures: Figures, side: str, rng: Draw) -> None:
    """Arms folded before the chest: each wrist near the other elbow."""
    n, sign = figures.n, SIDES[side]
    in_front_m = 0.19 if side == 'left' else 0.26  # one forearm lies over the other
    place = vectors(
        -sign * rng.uniform(0.04, 0.13, n), rng.uniform(-0.12, 0.0, n),
        in_front_m + rng.normal(0, 0.015, n))
    raise_collar(figures, side, np.zeros(n), rng.uniform(0.3, 0.9, n))
    figures.reach_arm(side, place, vectors(sign * 0.8, rng.uniform(-1.2, -0.5, n), 0.3))


def on_hip(figures: Figures, side: str, rng: Draw) -> None:
    """A hand on the hip, in a pocket, or at the belt."""
    n, sign = figures.n, SIDES[side]
    place = vectors(
        sign * rng.uniform(0.17, 0.24, n), rng.uniform(-0.02, 0.14, n),
        rng.uniform(-0.08, 0.12, n))
    raise_collar(figures, side, np.zeros(n), rng.normal(-0.1, 0.2, n))
    pole = vectors(sign * 1.0, 0.0, rng.uniform(-0.9, 0.2, n))
    upright = turned(place, figures.tilt)
    figures.reach_arm(side, figures.in_chest(upright), pole)


def at_head(figures: Figures, side: str, rng: Draw) -> None:
    """A hand at face, ear, chin, hair or behind the head."""
    n, sign = figures.n, SIDES[side]
    around = rng.uniform(-0.5, 2.4, n)  # 0 in front of the face, pi/2 at the ear
    radius = rng.uniform(0.14, 0.2, n)
    place = vectors(
        sign * radius * np.sin(around), 0.28 + rng.uniform(-0.1, 0.12, n),
        0.07 + radius * np.cos(around))
    raise_collar(figures, side, rng.uniform(0.2, 0.8, n), rng.normal(0.2, 0.3, n))
    figures.reach_arm(side, place, vectors(
        sign * rng.uniform(0.3, 1.2, n), rng.uniform(-1.0, 0.3, n), rng.uniform(-0.2, 0.6, n)))


def behind_back(figures: Figures, side: str, rng: Draw) -> None:
    """Hands clasped behind the back or in back pockets."""
    n, sign = figures.n, SIDES[side]
    place = vectors(
        sign * rng.uniform(0.02, 0.16, n), rng.uniform(-0.38, -0.2, n),
        rng.uniform(-0.24, -0.16, n))
    raise_collar(figures, side, np.zeros(n), rng.uniform(-0.6, -0.2, n))
    figures.reach_arm(side, place, vectors(sign * 1.0, 0.0, rng.uniform(-0.8, -0.3, n)))


def on_armrest(figures: Figures, side: str, rng: Draw) -> None:
    """A forearm on an armrest, a table or the back of a sofa."""
    n, sign = figures.n, SIDES[side]
    upper = normalised(vectors(
        sign * rng.uniform(0.1, 1.2, n), -1.0, rng.uniform(-0.35, 0.45, n)))
    forearm = normalised(vectors(
        sign * rng.uniform(-0.4, 0.6, n), rng.uniform(-0.3, 0.3, n), 1.0))
    raise_collar(figures, side, rng.uniform(-0.1, 0.4, n), np.zeros(n))
    figures.set_arm(side, upper, forearm, vectors(sign * 0.4, -0.6, np.full(n, -0.8)))


def propped(figures: Figures, side: str, rng: Draw) -> None:
    """A straight arm to the ground beside or behind, carrying the trunk."""
    n, sign = figures.n, SIDES[side]
    upper = normalised(vectors(
        sign * rng.uniform(0.1, 0.7, n), -1.0, rng.uniform(-0.8, 0.1, n)))
    forearm = normalised(upper + 0.15 * rng.normal(size=(n, 3)) + vectors(0.0, 0.0, 0.1))
    raise_collar(figures, side, rng.uniform(0.1, 0.5, n), rng.uniform(-0.4, 0.0, n))
    figures.set_arm(side, upper, forearm, vectors(sign * 0.4, 0.0, np.full(n, -1.0)))


def to_shin(figures: Figures, side: str, rng: Draw) -> None:
    """A hand at the knee's front or the shin: hugging knees, tying shoes, picking up."""
    n, sign = figures.n, SIDES[side]
    place = figures.knee(side) + vectors(
        -sign * rng.uniform(-0.05, 0.12, n), rng.uniform(-0.35, 0.02, n),
        rng.uniform(0.05, 0.2, n))
    raise_collar(figures, side, np.zeros(n), rng.uniform(0.3, 1.0, n))
    figures.reach_arm(side, figures.in_chest(place), outward_pole(figures, sign, rng))


def arm_length(figures: Figures) -> float:
    """Return the length of the straight arm, shoulder to wrist [m]."""
    return figures.length('left_elbow', 'left_shoulder') + figures.length(
        'left_wrist', 'left_elbow')


def _shared_seed(figures: Figures) -> int:
    """Return a seed that both arms of a batch agree on."""
    return int(np.abs(figures.tilt).sum() * 1e6) % (2**32)
