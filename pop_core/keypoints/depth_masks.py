"""Masks and body parts of people in the pixels of the measured image, from network cells."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float32, Int, Int8

from pop_core.keypoints import depth_mask_kernels as kernels
from pop_core.keypoints.body_parts import LABEL_OF_CLASS
from pop_core.keypoints.canonical_depth import CanonicalView

# A pixel belongs to a cell's surface when its depth differs by no more than a limb's bulge, and a
# slant that grows with the distance of the two.
BULGE_M, SLANT = 0.06, 0.02


def label_pixels(
    depth_m: Float32[np.ndarray, 'h w'], view: CanonicalView,
    owner: Int[np.ndarray, 'rows columns'], part: Int[np.ndarray, 'rows columns'],
    cell_depth_m: Float32[np.ndarray, 'rows columns'],
) -> tuple[Int8[np.ndarray, 'h w'], Int8[np.ndarray, 'h w']]:
    """Return the person (-1: nobody) and the part's joint (-1: none) at each measured pixel.

    A pixel takes what its own cell or one beside it says, provided that it lies on the surface
    that the cell speaks of.

    Args:
        depth_m: Measured depth, NaN where missing.
        view: The network's view.
        owner: Person of each cell, -1 for nobody.
        part: Class of the body part of each cell.
        cell_depth_m: Nearest depth of each cell [m].
    """
    person = np.full(depth_m.shape, -1, dtype=np.int8)
    label = np.full(depth_m.shape, -1, dtype=np.int8)
    if (owner >= 0).any():
        kernels.label_pixels(
            depth_m, view.cell, owner.astype(np.int8), LABEL_OF_CLASS[part], cell_depth_m,
            BULGE_M, SLANT, person, label)
    return person, label
