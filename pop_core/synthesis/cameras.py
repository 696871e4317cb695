"""Cameras that look at people in a room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec
from pop_core.geometry.transform import make_transform


@dataclass(frozen=True, slots=True)
class CameraRange:
    """What cameras are drawn from.

    Args:
        width: Image width [px].
        height: Image height [px].
        focal: Lowest and highest fx / width.
        distance_m: Lowest and highest distance to the first person.
        height_m: Lowest and highest height above the floor.
        aim_m: Spread of the point looked at, about the middle of the person.
        roll_deg: Largest roll.
    """

    width: int = 640
    height: int = 480
    focal: tuple[float, float] = (0.75, 1.05)
    distance_m: tuple[float, float] = (1.7, 4.0)
    height_m: tuple[float, float] = (0.7, 2.0)
    aim_m: float = 0.15
    roll_deg: float = 4.0


def draw_camera(
    target_room: Float[np.ndarray, '3'], ranges: CameraRange, rng: np.random.Generator
) -> tuple[Camera, Float[np.ndarray, '4 4']]:
    """Return intrinsics and T_camera_room of a camera at z > 0 that looks at a point [m]."""
    fx = rng.uniform(*ranges.focal) * ranges.width
    centre = rng.normal(0, 3.0, 2)
    camera = Camera(
        ranges.width, ranges.height, fx, fx * rng.uniform(0.995, 1.005),
        (ranges.width - 1) / 2 + centre[0], (ranges.height - 1) / 2 + centre[1])
    position = np.array([rng.normal(0, 0.3), rng.uniform(*ranges.height_m),
                         target_room[2] + rng.uniform(*ranges.distance_m)])
    aim = target_room + rng.normal(0, ranges.aim_m, 3)
    roll = np.deg2rad(rng.uniform(-ranges.roll_deg, ranges.roll_deg))
    return camera, look_at(position, aim, float(roll))


def look_at(
    position_room: Float[np.ndarray, '3'], aim_room: Float[np.ndarray, '3'], roll_rad: float = 0.0
) -> Float[np.ndarray, '4 4']:
    """Return T_camera_room (x right, y down, z forward) of a camera that looks at a point.

    Args:
        position_room: Optical centre [m].
        aim_room: Point on the optical axis [m].
        roll_rad: Turn about the optical axis.
    """
    forward = aim_room - position_room
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right = right / np.linalg.norm(right)
    level = np.stack([right, np.cross(forward, right), forward])
    R_camera_room = from_rotvec(np.array([0.0, 0.0, roll_rad])) @ level
    return make_transform(R_camera_room, -R_camera_room @ position_room)
