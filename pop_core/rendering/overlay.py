"""Fitted people over the colour image: shaded mesh, skeleton, and the contour of the mask."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from pop_core.body.joints import JOINT_INDEX, PARENTS
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.rendering.palette import INK, PAPER, person_color
from pop_core.rendering.shading import shade
from pop_core.rendering.shown_body import ShownBody, body_color

OPACITY, HIDDEN_OPACITY = 0.74, 0.34
HIDDEN_M = 0.12  # so far behind what was measured: noise and the error of a fit are smaller
EXPOSURE = 1.2  # of the mesh, which would look dull over a photograph; more shifts its hue
SHIFT = 4  # fractional bits of cv2's coordinates: joints are drawn where they are
AROUND_JOINT_M = 0.024
HEAD = JOINT_INDEX['head']
ABOVE_HEAD_M = 0.24  # the joint lies in the neck's upper end
PLATE_PX = 4
FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_people(
    rgb: UInt8[np.ndarray, 'h w 3'],
    bodies: Sequence[ShownBody],
    f: Int[np.ndarray, 'm 3'],
    camera: Camera,
    depth_m: Float32[np.ndarray, 'h w'] | None = None,
) -> UInt8[np.ndarray, 'h w 3']:
    """Return the colour image with meshes, farthest first, then all skeletons.

    Args:
        rgb: Undistorted colour image.
        bodies: People to draw.
        f: Triangles of their meshes.
        camera: Pinhole of the image.
        depth_m: Measured depth of the image; limbs behind it are drawn faint.
    """
    picture = rgb.copy()
    order = sorted(range(len(bodies)), key=lambda i: -float(bodies[i].joints[0, 2]))
    for index in order:
        color = body_color(bodies[index], index)
        draw_mesh(picture, bodies[index].vertices, f, camera, color, depth_m)
    for index in order:
        draw_mask_contour(picture, bodies[index].mask, body_color(bodies[index], index))
        draw_skeleton(picture, bodies[index].joints, bodies[index].joint_state, camera)
    for index in order:
        if bodies[index].id is not None:
            draw_id(picture, bodies[index], camera)
    return picture


def draw_mesh(
    picture: UInt8[np.ndarray, 'h w 3'],
    vertices_camera: Float[np.ndarray, 'n 3'],
    f: Int[np.ndarray, 'm 3'],
    camera: Camera,
    color: tuple[int, int, int],
    depth_m: Float32[np.ndarray, 'h w'] | None = None,
) -> None:
    """Blend a shaded mesh into the picture, faintly where measured depth [m] stands before it."""
    rendered, shaded = shade(vertices_camera, f, camera, color)
    seen = rendered.covered
    opacity = np.full(int(seen.sum()), OPACITY)
    if depth_m is not None:
        opacity[rendered.depth_m[seen] > depth_m[seen] + HIDDEN_M] = HIDDEN_OPACITY
    lit = np.minimum(EXPOSURE * shaded[seen], 255)
    picture[seen] = np.rint(opacity[:, None] * lit + (1 - opacity[:, None]) * picture[seen])


def draw_mask_contour(
    picture: UInt8[np.ndarray, 'h w 3'],
    mask: Bool[np.ndarray, 'h w'],
    color: tuple[int, int, int],
) -> None:
    """Draw the outline of a mask into the picture, dark under bright so that it shows anywhere."""
    contours, _ = cv2.findContours(
        mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    width = _line_width(picture)
    cv2.drawContours(picture, contours, -1, INK, width + 2, cv2.LINE_AA)
    cv2.drawContours(picture, contours, -1, color, width, cv2.LINE_AA)


def draw_skeleton(
    picture: UInt8[np.ndarray, 'h w 3'],
    joints_camera: Float[np.ndarray, '24 3'],
    joint_state: Int[np.ndarray, '24'],
    camera: Camera,
) -> None:
    """Draw bones and joints into the picture; joints that are not visible are hollow."""
    uv = camera.project(joints_camera)
    width = _line_width(picture)
    for child, parent in enumerate(PARENTS):
        if parent >= 0 and np.isfinite(uv[[child, parent]]).all():
            start, end = _fixed(uv[parent]), _fixed(uv[child])
            cv2.line(picture, start, end, INK, width + 2, cv2.LINE_AA, SHIFT)
            cv2.line(picture, start, end, PAPER, width, cv2.LINE_AA, SHIFT)
    for point, state, z in zip(uv, joint_state, joints_camera[:, 2], strict=True):
        if np.isfinite(point).all():
            radius = float(np.clip(AROUND_JOINT_M * camera.fx / z, 2.5, 7.0))
            filled = bool(state == JointState.VISIBLE)
            _draw_joint(picture, point, radius, width, filled=filled)


def draw_id(
    picture: UInt8[np.ndarray, 'h w 3'], body: ShownBody, camera: Camera
) -> None:
    """Write a person's number on a plate above the head, or at the edge where that is outside."""
    assert body.id is not None
    uv = camera.project((body.joints[HEAD] - [0.0, ABOVE_HEAD_M, 0.0])[None])[0]
    if not np.isfinite(uv).all():
        return
    scale = max(0.5, picture.shape[1] / 1100)
    (width, height), _ = cv2.getTextSize(f'{body.id}', FONT, scale, 2)
    u, v = np.rint(np.clip(uv, -1e4, 1e4)).astype(int)
    left, bottom = int(u) - width // 2, max(int(v), height + PLATE_PX)
    corners = (left - PLATE_PX, bottom - height - PLATE_PX), (
        left + width + PLATE_PX, bottom + PLATE_PX)
    cv2.rectangle(picture, *corners, person_color(body.id), cv2.FILLED)
    cv2.putText(picture, f'{body.id}', (left, bottom), FONT, scale, INK, 2, cv2.LINE_AA)


def _draw_joint(
    picture: UInt8[np.ndarray, 'h w 3'],
    uv: Float[np.ndarray, '2'],
    radius_px: float,
    width: int,
    *,
    filled: bool,
) -> None:
    center, radius = _fixed(uv), round(radius_px * (1 << SHIFT))
    inside = PAPER if filled else INK
    cv2.circle(picture, center, radius, inside, cv2.FILLED, cv2.LINE_AA, SHIFT)
    cv2.circle(picture, center, radius, INK if filled else PAPER, width, cv2.LINE_AA, SHIFT)


def _fixed(uv: Float[np.ndarray, '2']) -> tuple[int, int]:
    """Return a pixel in cv2's fixed point; far outside points are clipped, not wrapped."""
    u, v = np.clip(np.rint(uv * (1 << SHIFT)), -1e6, 1e6).astype(int)
    return int(u), int(v)


def _line_width(picture: UInt8[np.ndarray, 'h w 3']) -> int:
    return max(1, round(picture.shape[1] / 640))
