"""The scene from the side and from above: measured points and fitted meshes, to one scale.

A view frame has x right, y down and z away from its viewer, who stands far off so that rays are
almost parallel; the origin is the centre of what is shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from pop_core.geometry.camera import Camera
from pop_core.rendering.palette import FAINT, INK, PAPER
from pop_core.rendering.shading import shade
from pop_core.rendering.shown_body import ShownBody, body_color
from pop_core.rgbd import RgbdFrame, point_cloud

# Rows are the view's axes in the camera frame.
FROM_THE_RIGHT = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])  # looks along camera -x
FROM_ABOVE = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # looks along camera +y
VIEWER_M = 60.0
MARGIN_M = 0.35
SLAB_M = 0.6  # furniture beside a person, as seen by the viewer, is left out beyond this
OPACITY = 0.75
POINT_SHARE = 0.3  # of a mesh's pixels that its measured points may cover: its form stays readable


@dataclass(frozen=True, slots=True, eq=False)
class SceneView:
    """A view onto the scene.

    Args:
        R_view_camera: Axes of the view.
        center: Shown in the middle of the picture [m], camera frame.
        camera: Pinhole of the far viewer.
    """

    R_view_camera: Float[np.ndarray, '3 3']
    center: Float[np.ndarray, '3']
    camera: Camera

    def points(self, p_camera: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n 3']:
        """Return points in the view frame, as far off as its viewer stands."""
        offset = np.array([0, 0, VIEWER_M]) - self.R_view_camera @ self.center
        # Not matmul: BLAS starts threads for so many rows, and these take longer than the work.
        return np.einsum('nk,jk->nj', p_camera, self.R_view_camera) + offset


def fitting_view(
    R_view_camera: Float[np.ndarray, '3 3'],
    p_camera: Float[np.ndarray, 'n 3'],
    width: int,
    height: int,
) -> SceneView:
    """Return the view in which all points [m] are seen at the largest scale."""
    low, high = p_camera.min(axis=0) - MARGIN_M, p_camera.max(axis=0) + MARGIN_M
    extent = np.abs(R_view_camera @ (high - low))
    scale_px = min(width / extent[0], height / extent[1])  # pixels per metre
    f = scale_px * VIEWER_M
    camera = Camera(width, height, f, f, (width - 1) / 2, (height - 1) / 2)
    return SceneView(R_view_camera, (low + high) / 2, camera)


def draw_scene(
    frame: RgbdFrame, bodies: Sequence[ShownBody], f: Int[np.ndarray, 'm 3'], view: SceneView
) -> UInt8[np.ndarray, 'h w 3']:
    """Return the picture of a view: the scene's points, meshes over them, people's points on top.

    Args:
        frame: Undistorted frame; the points that are drawn.
        bodies: Fitted people, with masks in the pixels of `frame`.
        f: Triangles of their meshes.
        view: Where from.
    """
    picture = np.full((view.camera.height, view.camera.width, 3), PAPER, dtype=np.uint8)
    _draw_points(picture, frame, view, bodies)
    farthest_first = sorted(
        enumerate(bodies), key=lambda item: -view.points(item[1].joints)[0, 2])
    covered = dict.fromkeys(range(len(bodies)), 0)
    for index, body in farthest_first:
        rendered, shaded = shade(
            view.points(body.vertices), f, view.camera, body_color(body, index))
        seen = rendered.covered
        picture[seen] = np.rint(OPACITY * shaded[seen] + (1 - OPACITY) * picture[seen])
        covered[index] = int(seen.sum())
    for index, body in enumerate(bodies):
        points = point_cloud(frame, body.mask)[0]
        v, u, _ = _pixels(view.points(points), view)
        v, u = _thinned(v, u, round(POINT_SHARE * covered[index]))
        picture[v, u] = INK
    _draw_scale(picture, view)
    return picture


def _draw_points(
    picture: UInt8[np.ndarray, 'h w 3'],
    frame: RgbdFrame,
    view: SceneView,
    bodies: Sequence[ShownBody],
) -> None:
    """Draw measured points in their own, paled colours, the nearest to the viewer last."""
    points, uv = point_cloud(frame, np.ones(frame.depth_m.shape, dtype=bool))
    seen = view.points(points)
    along = seen[:, 2]
    keep = np.ones(len(points), dtype=bool)
    if bodies:
        around = np.concatenate([view.points(body.vertices)[:, 2] for body in bodies])
        keep = (along > around.min() - SLAB_M) & (along < around.max() + SLAB_M)
    v, u, inside = _pixels(seen[keep], view)
    order = np.argsort(-along[keep][inside], kind='stable')
    v, u = v[order], u[order]
    columns, rows = uv[keep][inside][order].astype(int).T
    color = frame.rgb[rows, columns].astype(np.float32)
    pale = np.rint(0.55 * color + 0.45 * np.array(PAPER, np.float32)).astype(np.uint8)
    for dv, du in ((0, 0), (0, 1), (1, 0), (1, 1)):  # two by two pixels: single ones hardly show
        picture[np.minimum(v + dv, picture.shape[0] - 1),
                np.minimum(u + du, picture.shape[1] - 1)] = pale


def _pixels(
    seen: Float[np.ndarray, 'n 3'], view: SceneView
) -> tuple[Int[np.ndarray, 'k'], Int[np.ndarray, 'k'], Bool[np.ndarray, 'n']]:
    """Return rows and columns of points of the view frame, and which are inside the picture."""
    uv = np.nan_to_num(np.rint(view.camera.project(seen)), nan=-1)
    inside = ((uv >= 0) & (uv < [view.camera.width, view.camera.height])).all(axis=1)
    u, v = uv[inside].astype(int).T
    return v, u, inside


def _thinned(
    v: Int[np.ndarray, 'n'], u: Int[np.ndarray, 'n'], count: int
) -> tuple[Int[np.ndarray, 'k'], Int[np.ndarray, 'k']]:
    """Return at most about `count` different pixels, spread evenly over those given."""
    pixels = np.unique(np.column_stack([v, u]), axis=0)
    if len(pixels) > max(count, 1):
        # Always the same ones; every n-th of sorted pixels would make stripes.
        rng = np.random.default_rng(0)
        pixels = rng.choice(pixels, max(count, 1), replace=False)
    return pixels[:, 0], pixels[:, 1]


def _draw_scale(picture: UInt8[np.ndarray, 'h w 3'], view: SceneView) -> None:
    """Draw a bar of half a metre into the lower right corner."""
    length = round(0.5 * view.camera.fx / VIEWER_M)
    right, bottom = view.camera.width - 16, view.camera.height - 16
    picture[bottom - 26: bottom + 8, right - length - 8: right + 8] = PAPER
    cv2.line(picture, (right - length, bottom), (right, bottom), FAINT, 2)
    for u in (right - length, right):
        cv2.line(picture, (u, bottom - 5), (u, bottom + 5), FAINT, 2)
    cv2.putText(
        picture, '0.5 m', (right - length, bottom - 9), cv2.FONT_HERSHEY_SIMPLEX, 0.42, FAINT, 1,
        cv2.LINE_AA)
