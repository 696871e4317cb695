"""The picture of a result: colour, depth, fitted people, and the scene from side and above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int, UInt8

from pop_core.estimate import FrameResult
from pop_core.rendering.overlay import draw_people
from pop_core.rendering.palette import PAPER
from pop_core.rendering.scene_view import FROM_ABOVE, FROM_THE_RIGHT, draw_scene, fitting_view
from pop_core.rendering.shown_body import ShownBody, shown
from pop_core.rendering.text import captioned, colored_depth
from pop_core.rgbd import RgbdFrame, point_cloud, undistort_frame, undistort_mask

GAP_PX = 6


def result_picture(
    frame: RgbdFrame, result: FrameResult, f: Int[np.ndarray, 'm 3']
) -> UInt8[np.ndarray, 'h w 3']:
    """Return the picture of a result of the pipeline."""
    return four_panels(frame, [shown(body) for body in result.bodies], f)


def four_panels(
    frame: RgbdFrame, bodies: Sequence[ShownBody], f: Int[np.ndarray, 'm 3'],
    extent: Float[np.ndarray, 'n 3'] | None = None,
) -> UInt8[np.ndarray, 'h w 3']:
    """Return colour, depth, overlay, and side and top view, two by two.

    Args:
        frame: What the camera measured.
        bodies: The people in it.
        f: Triangles of their meshes.
        extent: Points that side and top view contain too [m], so that those of a film agree.
    """
    colour, depth, overlay, views = result_panels(frame, bodies, f, extent)
    rows = [_beside(colour, depth), _beside(overlay, views)]
    return np.concatenate([rows[0], _gap(GAP_PX, rows[0].shape[1]), rows[1]])


def result_panels(
    frame: RgbdFrame, bodies: Sequence[ShownBody], f: Int[np.ndarray, 'm 3'],
    extent: Float[np.ndarray, 'n 3'] | None = None,
) -> list[UInt8[np.ndarray, 'h w 3']]:
    """Return the captioned panels colour, depth, overlay and views, all of the frame's size.

    Lens distortion is taken out of all of them: meshes are drawn as a pinhole sees them.
    """
    seen = undistort_frame(frame)
    people = [replace(b, mask=undistort_mask(b.mask, frame.camera)) for b in bodies]
    overlay = draw_people(seen.rgb, people, f, seen.camera, seen.depth_m)
    count = len(people)
    return [
        captioned(seen.rgb, 'colour'),
        captioned(colored_depth(seen.depth_m), 'depth'),
        captioned(overlay, f'fit: {count} {"person" if count == 1 else "people"}'),
        _views(seen, people, f, extent),
    ]


def extent_of(bodies: Sequence[ShownBody]) -> Float[np.ndarray, 'n 3']:
    """Return the corners of the box around people [m]; none without any."""
    if not bodies:
        return np.zeros((0, 3))
    everyone = np.concatenate([body.vertices for body in bodies])
    return np.array([everyone.min(axis=0), everyone.max(axis=0)])


def _views(
    frame: RgbdFrame, bodies: Sequence[ShownBody], f: Int[np.ndarray, 'm 3'],
    extent: Float[np.ndarray, 'n 3'] | None,
) -> UInt8[np.ndarray, 'h w 3']:
    """Return the side view beside the top view, in one panel of the frame's size."""
    shown = extent_of(bodies) if extent is None else np.concatenate([extent, extent_of(bodies)])
    if not len(shown):
        shown = _extent_of_scene(frame)
    height, width = frame.depth_m.shape
    left = (width - GAP_PX) // 2
    side = fitting_view(FROM_THE_RIGHT, shown, left, height)
    top = fitting_view(FROM_ABOVE, shown, width - GAP_PX - left, height)
    return _beside(
        captioned(draw_scene(frame, bodies, f, side), 'from the right'),
        captioned(draw_scene(frame, bodies, f, top), 'from above'))


def _extent_of_scene(frame: RgbdFrame) -> Float[np.ndarray, '2 3']:
    """Return the corners of the box around most of what was measured [m]."""
    cloud = point_cloud(frame, np.ones(frame.depth_m.shape, dtype=bool))[0]
    if not len(cloud):
        return np.array([[-1.0, -1, 1], [1, 1, 3]])
    return np.percentile(cloud, [2.0, 98.0], axis=0)


def _beside(
    left: UInt8[np.ndarray, 'h a 3'], right: UInt8[np.ndarray, 'h b 3']
) -> UInt8[np.ndarray, 'h c 3']:
    return np.concatenate([left, _gap(left.shape[0], GAP_PX), right], axis=1)


def _gap(height: int, width: int) -> UInt8[np.ndarray, 'h w 3']:
    return np.full((height, width, 3), PAPER, dtype=np.uint8)
