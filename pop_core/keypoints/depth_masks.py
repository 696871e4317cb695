"""Masks and body parts of people in the pixels of the measured image, from network cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int, Int8

from pop_core.geometry.camera import Camera
from pop_core.keypoints import depth_mask_kernels as kernels
from pop_core.keypoints.body_parts import BACKGROUND, LABEL_OF_CLASS
from pop_core.keypoints.canonical_depth import STRIDE
from pop_core.keypoints.close_view import NetworkView
from pop_core.keypoints.depth_votes import Cells
from pop_core.rgbd import RgbdFrame

# A pixel belongs to a cell's surface when its depth differs by no more than a limb's bulge, and a
# slant that grows with the distance of the two.
BULGE_M, SLANT = 0.06, 0.02
BESIDE = 1.5  # cells; pixels take from cells beside their own


@dataclass(frozen=True, slots=True, eq=False)
class PixelLabels:
    """Whose each measured pixel is, and which part of the body.

    Args:
        person: Number of the person, -1 for nobody.
        part: Joint that stands for the part, -1 for none.
    """

    person: Int8[np.ndarray, 'h w']
    part: Int8[np.ndarray, 'h w']


def no_labels(shape: tuple[int, int]) -> PixelLabels:
    """Return an image of nobody."""
    return PixelLabels(np.full(shape, -1, dtype=np.int8), np.full(shape, -1, dtype=np.int8))


def label_pixels(
    labels: PixelLabels, person: int, cells: Cells, view: NetworkView,
    frame: RgbdFrame, rays: Float32[np.ndarray, 'h w 2'],
) -> None:
    """Give a person the pixels of their cells that are nobody's yet.

    A pixel takes what its own cell or one beside it says, provided that it lies on the surface
    that the cell speaks of.

    Args:
        labels: What is filled.
        person: Number of the person.
        cells: Those that show the person.
        view: What the network was shown.
        frame: What was measured.
        rays: (x/z, y/z) of each measured pixel.
    """
    shown = view.camera
    rows, columns = shown.height // STRIDE, shown.width // STRIDE
    own, part = np.zeros((rows, columns), dtype=bool), np.zeros((rows, columns), dtype=np.int8)
    surface_m = np.full((rows, columns), np.inf)
    own[cells.row, cells.column] = True
    surface_m[cells.row, cells.column] = cells.depth_m
    likely = cells.part.copy()
    likely[:, BACKGROUND] = 0.0
    part[cells.row, cells.column] = LABEL_OF_CLASS[likely.argmax(axis=1)]
    lens = np.array([shown.fx * view.enlarged, shown.cx + 0.5, shown.cy + 0.5]) / STRIDE
    kernels.label_pixels(
        frame.depth_m, rays, _box(cells, lens, frame.camera), lens, own, part, surface_m,
        BULGE_M, SLANT, person, labels.person, labels.part)


def _box(
    cells: Cells, lens: Float[np.ndarray, '3'], camera: Camera
) -> Int[np.ndarray, '4']:
    """Return the box of pixels around cells: left, top, right, bottom, inclusive."""
    low = np.array([cells.column.min(), cells.row.min()]) - BESIDE
    high = np.array([cells.column.max(), cells.row.max()]) + 1 + BESIDE
    steps = np.linspace(0.0, 1.0, 5)
    corners = low + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * (high - low)
    rays = (corners - lens[1:]) / lens[0]
    uv = camera.project(np.column_stack([rays, np.ones(len(rays))]))
    last = np.array([camera.width, camera.height]) - 1
    uv = np.clip(uv, 0, last)
    return np.concatenate([np.floor(uv.min(axis=0)), np.ceil(uv.max(axis=0))]).astype(np.int64)
