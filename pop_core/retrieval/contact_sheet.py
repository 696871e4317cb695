"""A picture of many poses at once: what a library holds, for human eyes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, UInt8

from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.rendering.depth_renderer import render_depth, vertex_normals
from pop_core.retrieval.pose_library import PoseLibrary

DISTANCE_M = 5.0
LIGHT_CAMERA = np.array([-0.35, -0.6, -0.72])
SKIN_RGB = np.array([214.0, 186.0, 164.0])
PAPER_RGB = 250


def contact_sheet(
    library: PoseLibrary,
    index: Sequence[int],
    model: BodyModel,
    *,
    columns: int = 10,
    tile_px: int = 160,
    turn_rad: float = 0.6,
) -> UInt8[np.ndarray, 'h w 3']:
    """Return pictures of library poses in rows, seen upright from slightly above.

    Args:
        library: Poses.
        index: Rows of the library to show, one tile each.
        model: Body to show them on.
        columns: Tiles per row.
        tile_px: Side of a tile [px].
        turn_rad: Turn of every figure about the vertical: zero faces the viewer.
    """
    rows = -(-len(index) // columns)
    sheet = np.full((rows * tile_px, columns * tile_px, 3), PAPER_RGB, dtype=np.uint8)
    for tile, pose in enumerate(index):
        top, left = tile_px * (tile // columns), tile_px * (tile % columns)
        sheet[top: top + tile_px, left: left + tile_px] = pose_picture(
            np.asarray(library.body_pose[pose], dtype=np.float64),
            np.asarray(library.tilt[pose], dtype=np.float64), model, tile_px, turn_rad)
    return sheet


def pose_picture(
    body_pose: Float[np.ndarray, '23 3'],
    tilt: Float[np.ndarray, '3'],
    model: BodyModel,
    size_px: int,
    turn_rad: float,
) -> UInt8[np.ndarray, 'h w 3']:
    """Return one pose as a shaded square picture."""
    view = from_rotvec(np.array([np.pi + 0.25, 0.0, 0.0]))
    R = view @ from_rotvec(np.array([0.0, turn_rad, 0.0])) @ from_rotvec(tilt)
    mesh = vertices(model, BodyParameters(
        np.zeros(3), to_rotvec(R), body_pose, np.zeros(model.n_betas)))
    middle = 0.5 * (mesh.min(axis=0) + mesh.max(axis=0))
    mesh = mesh - middle + [0.0, 0.0, DISTANCE_M]
    focal = 0.47 * size_px * DISTANCE_M
    half = 0.5 * (size_px - 1)
    camera = Camera(size_px, size_px, focal, focal, half, half)
    rendered = render_depth(mesh, model.f, camera)
    normals = vertex_normals(mesh, model.f)
    facing = normals[model.f[np.maximum(rendered.face, 0)]].mean(axis=2)
    shade = 0.35 + 0.65 * np.clip(facing @ LIGHT_CAMERA, 0.0, 1.0)
    colour = np.where(rendered.covered[..., None], shade[..., None] * SKIN_RGB, PAPER_RGB)
    return np.clip(colour, 0, 255).astype(np.uint8)
