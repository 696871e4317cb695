"""Depth of rooms and blocks by ray casting: exact, without triangles, for many small images."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import invert_transform
from pop_core.synthesis import ray_casting_kernels as kernels
from pop_core.synthesis.blocks import Block, yaw_matrix
from pop_core.synthesis.rooms import Room

CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def cast_rays(
    room: Room, blocks: Sequence[Block], camera: Camera, T_camera_room: Float[np.ndarray, '4 4']
) -> Float32[np.ndarray, 'h w']:
    """Return the depth [m] of a furnished room; +inf where a ray leaves through an open side.

    Args:
        room: Walls; those at infinity are open.
        blocks: Solids, room frame. One that the camera is inside of is not seen.
        camera: Camera without distortion, inside the room.
        T_camera_room: Camera from room.
    """
    depth_m = np.empty((camera.height, camera.width), dtype=np.float32)
    T_room_camera = invert_transform(T_camera_room)
    R_room_camera, eye = np.ascontiguousarray(T_room_camera[:3, :3]), T_room_camera[:3, 3]
    lens = (camera.fx, camera.fy, camera.cx, camera.cy)
    low = np.array([-room.half_width_m, 0.0, -room.back_m])
    high = np.array([room.half_width_m, room.height_m, room.front_m])
    kernels.cast_room(low, high, np.ascontiguousarray(eye), R_room_camera, *lens, depth_m)
    for block in blocks:
        half = block.size_m / 2
        turn = yaw_matrix(block.yaw_rad)
        centre = block.base + [0.0, half[1], 0.0]
        window = _window(centre + (CORNERS * half) @ turn.T, camera, T_camera_room)
        if window is not None:
            kernels.cast_block(
                int(block.shape), half, turn.T @ R_room_camera, turn.T @ (eye - centre), *lens,
                window, depth_m)
    return depth_m


def _window(
    corners_room: Float[np.ndarray, '8 3'], camera: Camera, T_camera_room: Float[np.ndarray, '4 4']
) -> Int[np.ndarray, '4'] | None:
    """Return the pixels (left, top, right, bottom) that a box may cover, None when none."""
    p = corners_room @ T_camera_room[:3, :3].T + T_camera_room[:3, 3]
    last = np.array([camera.width - 1, camera.height - 1])
    if (p[:, 2] < kernels.NEAR_M).all():
        return None
    if (p[:, 2] < kernels.NEAR_M).any():
        return np.array([0, 0, *last])
    uv = p[:, :2] / p[:, 2:] * [camera.fx, camera.fy] + [camera.cx, camera.cy]
    low = np.maximum(np.ceil(uv.min(axis=0)), 0).astype(np.int64)
    high = np.minimum(np.floor(uv.max(axis=0)), last).astype(np.int64)
    return np.concatenate([low, high]) if (low <= high).all() else None
