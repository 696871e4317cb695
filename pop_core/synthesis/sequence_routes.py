"""Ways that people take through a room, as place and heading over time (room frame, [m])."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

WALKING_M_S = 1.05
STEP_M = 0.005  # of the table that a curved way is read from


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where a person is on the floor.

    Args:
        p: Point of the floor, y = 0.
        yaw_rad: Heading, 0 along +z, a quarter turn along +x.
    """

    p: Float[np.ndarray, '3']
    yaw_rad: float


Route = Callable[[float], Place]


def ease(share: float) -> float:
    """Return 0..1 for 0..1 as limbs move: at rest on both ends (Flash and Hogan 1985)."""
    x = min(max(share, 0.0), 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2)


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """There and back again: two straights joined by half turns, at constant speed.

    Args:
        middle: Middle of the first straight.
        yaw_rad: Heading there.
        straight_m: Length of a straight.
        turn_m: Length of a half turn, negative to turn to the right.
        at_start_m: Way walked from the middle at time 0.
        speed_m_s: Speed.
    """

    middle: Float[np.ndarray, '3']
    yaw_rad: float
    straight_m: float
    turn_m: float
    at_start_m: float = 0.0
    speed_m_s: float = WALKING_M_S
    _table: Float[np.ndarray, 'n 4'] = field(init=False)  # way, x, z, yaw

    def __post_init__(self) -> None:
        turn = abs(self.turn_m)
        length = 2 * (self.straight_m + turn)
        way = np.linspace(0.0, length, round(length / STEP_M) + 1)
        first = _smooth((way - self.straight_m / 2) / turn)
        second = _smooth((way - 1.5 * self.straight_m - turn) / turn)
        yaw = self.yaw_rad + np.sign(self.turn_m) * np.pi * (first + second)
        ahead = np.column_stack([np.sin(yaw), np.cos(yaw)])
        pieces = (ahead[1:] + ahead[:-1]) / 2 * way[1]
        along = np.concatenate([np.zeros((1, 2)), np.cumsum(pieces, axis=0)])
        object.__setattr__(self, '_table', np.column_stack([way, along, yaw]))

    def __call__(self, seconds: float) -> Place:
        """Return place and heading at a time; the heading grows from lap to lap."""
        way = self._table[:, 0]
        laps, rest = divmod(self.at_start_m + self.speed_m_s * seconds, way[-1])
        x, z, yaw = (np.interp(rest, way, column) for column in self._table[:, 1:].T)
        p = self.middle + np.array([x, 0.0, z])
        return Place(p, float(yaw + laps * np.sign(self.turn_m) * 2 * np.pi))


@dataclass(frozen=True, slots=True, eq=False)
class TurnAround:
    """On the spot: half turns with rests between them.

    Args:
        p: Where.
        yaw_rad: Heading at time 0.
        turn_s: Time of a half turn.
        rest_s: Time of a rest, which comes first.
    """

    p: Float[np.ndarray, '3']
    yaw_rad: float
    turn_s: float = 1.6
    rest_s: float = 0.8

    def __call__(self, seconds: float) -> Place:
        """Return place and heading at a time."""
        turns, rest = divmod(seconds, self.turn_s + self.rest_s)
        share = ease((rest - self.rest_s) / self.turn_s)
        return Place(self.p, float(self.yaw_rad + np.pi * (turns + share)))


def _smooth(share: Float[np.ndarray, 'n']) -> Float[np.ndarray, 'n']:
    """Return 0..1 for 0..1 with a curvature that begins and ends at nothing."""
    x = np.clip(share, 0.0, 1.0)
    return x - np.sin(2 * np.pi * x) / (2 * np.pi)
