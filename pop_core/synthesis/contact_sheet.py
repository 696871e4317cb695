"""Scenes side by side in one picture, to be looked at before they are trusted."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float32, UInt8

from pop_core.estimate import JointState
from pop_core.synthesis.scenes import SyntheticScene

TILE_PX = 320
COLUMNS = 3
STATE_COLOURS = {
    JointState.VISIBLE: (40, 220, 60), JointState.SELF_OCCLUDED: (255, 190, 0),
    JointState.SCENE_OCCLUDED: (240, 40, 40), JointState.OUT_OF_IMAGE: (220, 60, 220),
}


def contact_sheet(scenes: Sequence[SyntheticScene]) -> UInt8[np.ndarray, 'h w 3']:
    """Return colour with the shared points (green seen, red hidden) beside depth, RGB."""
    tiles = [scene_tile(scene) for scene in scenes]
    height = max(tile.shape[0] for tile in tiles)
    rows = -(-len(tiles) // COLUMNS)
    sheet = np.zeros((rows * height, COLUMNS * 2 * TILE_PX, 3), dtype=np.uint8)
    for k, tile in enumerate(tiles):
        top, left = k // COLUMNS * height, k % COLUMNS * 2 * TILE_PX
        sheet[top: top + tile.shape[0], left: left + tile.shape[1]] = tile
    return sheet


def colour_depth(depth_m: Float32[np.ndarray, 'h w']) -> UInt8[np.ndarray, 'h w 3']:
    """Return depth in colours, near red to far blue over its own range, black where missing."""
    known = np.isfinite(depth_m)
    if not known.any():
        return np.zeros((*depth_m.shape, 3), dtype=np.uint8)
    near, far = np.percentile(depth_m[known], [1, 99])
    share = np.nan_to_num((far - depth_m) / max(float(far - near), 1e-3))
    codes = np.clip(share * 255, 0, 255).astype(np.uint8)
    coloured: UInt8[np.ndarray, 'h w 3'] = cv2.applyColorMap(codes, cv2.COLORMAP_TURBO)[..., ::-1]
    return np.where(known[..., None], coloured, 0).astype(np.uint8)


def scene_tile(scene: SyntheticScene) -> UInt8[np.ndarray, 'h w 3']:
    """Return colour with the shared points beside depth."""
    image = scene.frame.rgb.copy()
    for person in scene.people:
        pixels = scene.frame.camera.project(person.shared_points)
        for uv, state in zip(pixels, person.shared_state, strict=True):
            if np.isfinite(uv).all():
                centre = (round(float(uv[0])), round(float(uv[1])))
                cv2.circle(image, centre, 4, STATE_COLOURS[JointState(int(state))], -1)
    pair = np.hstack([image, colour_depth(scene.frame.depth_m)])
    height = round(pair.shape[0] * 2 * TILE_PX / pair.shape[1])
    resized: UInt8[np.ndarray, 'h w 3'] = cv2.resize(
        pair, (2 * TILE_PX, height), interpolation=cv2.INTER_AREA)
    return resized
