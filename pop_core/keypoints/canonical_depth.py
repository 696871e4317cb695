"""Depth as one pinhole of fixed focal length sees it, whatever camera measured it.

A network that knows how many pixels a metre has at each distance need not learn it from scenes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth_kernels import read_depth

STRIDE = 4  # canonical pixels per cell of the network's output
SIDE_MULTIPLE = 32
LARGEST_SIDE = 1024  # wider views than this many canonical pixels are cut at the sides


@dataclass(frozen=True, slots=True, eq=False)
class CanonicalView:
    """The pinhole of a network's input, and where its pixels lie in the measured image.

    Args:
        camera: Pinhole with sides divisible by 32.
        source_v: Row of the measured image per canonical pixel, -1 outside.
        source_u: Column of it.
    """

    camera: Camera
    source_v: Int[np.ndarray, 'H W']
    source_u: Int[np.ndarray, 'H W']


def canonical_view(
    camera: Camera, rays: Float[np.ndarray, 'h w 2'], focal_px: float,
    largest_px: float = LARGEST_SIDE,
) -> CanonicalView:
    """Return the view that covers a camera's image.

    Args:
        camera: The measuring camera; lens distortion is undone.
        rays: (x/z, y/z) of each of its pixels.
        focal_px: Focal length of the view [px].
        largest_px: Wider views than this are cut at the sides [px].
    """
    low, high = (_extreme(rays, focal_px, side, largest_px / 2) for side in (0, 1))
    width, height = (_side(b - a) for a, b in zip(low, high, strict=True))
    # What padding there is lies evenly on both sides.
    cx, cy = ((size - 1) / 2 - (a + b) / 2 for size, a, b in zip(
        (width, height), low, high, strict=True))
    view = Camera(width, height, focal_px, focal_px, float(cx), float(cy))
    grid = view.ray_grid().reshape(-1, 2)
    uv = camera.project(np.column_stack([grid, np.ones(len(grid))]))
    nearest = np.rint(np.nan_to_num(uv, nan=-1.0)).astype(np.int64)
    inside = ((nearest >= 0) & (nearest < [camera.width, camera.height])).all(axis=1)
    nearest[~inside] = -1
    return CanonicalView(
        view, nearest[:, 1].reshape(height, width), nearest[:, 0].reshape(height, width))


def canonical_depth(
    depth_m: Float32[np.ndarray, 'h w'], view: CanonicalView
) -> Float32[np.ndarray, 'H W']:
    """Return measured depth [m] in the pixels of a view; 0 where nothing was measured.

    A pixel is read, not averaged: means of near and far are nowhere. Where it is missing, the
    next one beside it is taken.
    """
    out = np.empty(view.source_v.shape, dtype=np.float32)
    rows, columns = (np.arange(size) for size in view.source_v.shape)
    read_depth(depth_m, view.source_v, view.source_u, rows, columns, 0.0, 0.0, out)
    return out


def _extreme(
    rays: Float[np.ndarray, 'h w 2'], focal_px: float, side: int, bound: float
) -> Float[np.ndarray, '2']:
    """Return the least (0) or greatest (1) canonical u and v, within what a network can take."""
    uv = np.nan_to_num(rays.reshape(-1, 2) * focal_px)
    extreme = uv.max(axis=0) if side else uv.min(axis=0)
    return np.clip(extreme, -bound, bound)


def _side(extent_px: float) -> int:
    """Return the least multiple of 32 that holds pixels over an extent between their centres."""
    return int(SIDE_MULTIPLE * np.ceil((np.ceil(extent_px) + 1) / SIDE_MULTIPLE))
