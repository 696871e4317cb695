"""Walking along a route: feet that stand still on the floor while the body passes over them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.synthesis.blocks import yaw_matrix
from pop_core.synthesis.pose_parts import set_joint, standing_base
from pop_core.synthesis.poses import swing_arms
from pop_core.synthesis.sequence_legs import Feet, Legs
from pop_core.synthesis.sequence_routes import WALKING_M_S, Route, ease

STEP_PAIR_S = 1.0
STANCE = 0.3        # half the share of a pair of steps that a foot stands
AHEAD_S = 0.09      # a foot is put down where the body will be before the middle of its stance
APART_M = 0.09      # of each foot from the line walked
LIFT_M = 0.05
HEEL_RAD = 0.8
SWAY_M = 0.018
STOOP_M, BOB_M = 0.065, 0.02
LOWEST = 0.2        # moment of the pair of steps with both feet on the floor
LEAN_RAD = 0.05
LONG_STEP_M = 0.6   # a foot that moves this far is lifted fully


class Walk:
    """One person on a route; who does not move along it stands."""

    def __init__(
        self, model: BodyModel, betas: Float[np.ndarray, 'b'], route: Route, start: float = 0.0
    ) -> None:
        """Take a person and a way.

        Args:
            model: Body model.
            betas: Shape.
            route: Place and heading over time.
            start: Moment of the pair of steps at time 0, 0..1.
        """
        self._betas, self._route, self._start = betas, route, start
        self._legs = Legs(model, betas)
        self._base = standing_base(model, np.zeros(2))
        self._root = model.joint_template[0] + model.joint_shapedirs[0] @ betas

    def __call__(self, seconds: float) -> BodyParameters:
        """Return the body at a time, room frame."""
        place = self._route(seconds)
        before, after = self._route(seconds - 0.25), self._route(seconds + 0.25)
        pace = float(np.linalg.norm(after.p - before.p)) / 0.5 / WALKING_M_S
        steps = seconds / STEP_PAIR_S + self._start
        phase = 2 * np.pi * (steps + STANCE + 0.25)  # left leg foremost when put down
        pose = self._base.copy()
        swing_arms(pose, phase, pace)
        set_joint(pose, 'spine2', [0.0, np.deg2rad(5) * pace * np.sin(phase), 0.0])
        turn = yaw_matrix(place.yaw_rad)
        sway = turn @ np.array([SWAY_M * pace * np.cos(2 * np.pi * steps), 0.0, 0.0])
        lean = turn @ from_rotvec(np.array([LEAN_RAD * pace, 0.0, 0.0]))
        standing = BodyParameters(
            place.p + sway - self._root * np.array([1.0, 0.0, 1.0]), to_rotvec(lean), pose,
            self._betas)
        stoop = STOOP_M + BOB_M * np.cos(4 * np.pi * (steps - LOWEST))
        return self._legs.planted(standing, self._feet(steps), pace * stoop)

    def _feet(self, steps: float) -> Feet:
        """Return both feet: on their print, or on the way to the next."""
        soles, yaw, heel = np.empty((2, 3)), np.empty(2), np.empty(2)
        for k, delay in enumerate((0.0, 0.5)):
            stance = np.floor(steps - delay + STANCE)
            since = steps - delay - stance
            p0, yaw0 = self._footprint(stance + delay, k)
            p1, yaw1 = self._footprint(stance + 1 + delay, k)
            share = ease((since - STANCE) / (1 - 2 * STANCE))
            length = float(np.linalg.norm(p1 - p0)) + 0.3 * abs(yaw1 - yaw0)
            effort = min(length / LONG_STEP_M, 1.0)
            soles[k] = p0 + share * (p1 - p0)
            soles[k, 1] = LIFT_M * effort * np.sin(np.pi * share) ** 2
            yaw[k] = yaw0 + share * (yaw1 - yaw0)
            raised = ease((since - 0.05) / 0.3) - ease((since - 0.35) / (0.65 - STANCE))
            heel[k] = HEEL_RAD * effort * raised
        return Feet(soles, yaw, heel)

    def _footprint(self, stance: float, side: int) -> tuple[Float[np.ndarray, '3'], float]:
        """Return place and heading of a foot while it stands [m]."""
        place = self._route((stance - self._start) * STEP_PAIR_S - AHEAD_S)
        aside = np.array([APART_M if side == 0 else -APART_M, 0.0, 0.0])
        return place.p + yaw_matrix(place.yaw_rad) @ aside, place.yaw_rad
