"""Where a fitted surface is off: distances from the truth as colours, from three sides [m]."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8

from pop_core.geometry.camera import Camera
from pop_core.rendering.palette import INK, PAPER
from pop_core.rendering.scene_view import FROM_ABOVE, FROM_THE_RIGHT, fitting_view
from pop_core.rendering.shading import shade
from pop_core.rendering.text import captioned

LARGEST_M = 0.15  # darker than that is all the same: the limb is somewhere else
TICKS_M = (0.0, 0.05, 0.10, 0.15)
BAR_PX = 46
GAP_PX = 6
WHITE = (255, 255, 255)


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredSurface:
    """A fitted mesh whose errors are known.

    Args:
        vertices: Mesh [m], camera frame.
        error_m: Distance of each vertex from where it truly is [m].
    """

    vertices: Float[np.ndarray, 'v 3']
    error_m: Float[np.ndarray, 'v']


def heat_map(
    rgb: UInt8[np.ndarray, 'h w 3'],
    people: Sequence[MeasuredSurface],
    f: Int[np.ndarray, 'm 3'],
    camera: Camera,
) -> UInt8[np.ndarray, 'h2 w2 3']:
    """Return the errors over the image, and from the right and from above, with their scale.

    Args:
        rgb: Undistorted colour image.
        people: At least one fitted mesh.
        f: Triangles of the meshes.
        camera: Pinhole of the image.
    """
    height, width = rgb.shape[:2]
    in_image = (rgb // 2 + 64).astype(np.uint8)
    farthest_first = sorted(people, key=lambda person: -float(person.vertices[:, 2].mean()))
    for person in farthest_first:
        _draw(in_image, person.vertices, person.error_m, f, camera)
    panels = [captioned(in_image, 'distance from the truth')]
    everyone = np.concatenate([person.vertices for person in people])
    for axes, name in ((FROM_THE_RIGHT, 'from the right'), (FROM_ABOVE, 'from above')):
        view = fitting_view(axes, everyone, width // 2, height)
        panel = np.full((height, width // 2, 3), PAPER, dtype=np.uint8)
        nearest_last = sorted(people, key=lambda p: -float(view.points(p.vertices)[:, 2].mean()))
        for person in nearest_last:
            _draw(panel, view.points(person.vertices), person.error_m, f, view.camera)
        panels.append(captioned(panel, name))
    gap = np.full((height, GAP_PX, 3), PAPER, dtype=np.uint8)
    row = np.concatenate([panels[0], gap, panels[1], gap, panels[2]], axis=1)
    return np.concatenate([row, _scale(row.shape[1])])


def heat_colors(error_m: Float[np.ndarray, 'n']) -> UInt8[np.ndarray, 'n 3']:
    """Return the colour (RGB) of each error: pale for none, dark red for a hand's breadth."""
    level = np.clip(np.rint(255 * error_m / LARGEST_M), 0, 255).astype(np.uint8)
    # From its light end: what is right should look calm.
    bgr = cv2.applyColorMap((255 - level).reshape(-1, 1), cv2.COLORMAP_MAGMA)
    return bgr[:, 0, ::-1].copy()


def _draw(
    picture: UInt8[np.ndarray, 'h w 3'],
    vertices: Float[np.ndarray, 'v 3'],
    error_m: Float[np.ndarray, 'v'],
    f: Int[np.ndarray, 'm 3'],
    camera: Camera,
) -> None:
    """Draw one mesh in the colours of its errors, shaded so that its form can be read."""
    rendered, brightness = shade(vertices, f, camera, WHITE)
    seen = rendered.covered
    colors = heat_colors(error_m[f].mean(axis=1))[rendered.face[seen]]
    light = 0.35 + 0.65 * brightness[seen] / 255.0
    picture[seen] = np.rint(colors * light).astype(np.uint8)


def _scale(width: int) -> UInt8[np.ndarray, 'h w 3']:
    """Return a bar of the colours with centimetres below."""
    bar = np.full((BAR_PX, width, 3), PAPER, dtype=np.uint8)
    left, right = 24, min(width - 90, 424)
    bar[8:22, left:right] = heat_colors(np.linspace(0, LARGEST_M, right - left))
    for tick in TICKS_M:
        u = round(left + (right - left - 1) * tick / LARGEST_M)
        more = ' cm or more' if tick == LARGEST_M else ''
        cv2.line(bar, (u, 22), (u, 27), INK, 1)
        cv2.putText(
            bar, f'{100 * tick:.0f}{more}', (u - 5, 40), cv2.FONT_HERSHEY_SIMPLEX, 0.4, INK, 1,
            cv2.LINE_AA)
    return bar
