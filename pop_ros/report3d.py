"""The interactive 3D view of a report: points, meshes and skeletons of a few frames.

Coordinates go into the page as whole millimetres of the camera frame: a millimetre is finer than
any depth sensor, and a page stays small.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import PARENTS
from pop_core.rendering.shown_body import ShownBody, body_color
from pop_core.rgbd import RgbdFrame, point_cloud, undistort_frame, undistort_mask

MAX_POINTS = 36_000  # of room and of people: 0.4 MB of a page each, at most
NEAR_M = 2.2  # the room farther from people than that says nothing about them
STYLE = """
.scene3d canvas { width: 100%; aspect-ratio: 16 / 10; display: block; border-radius: 6px;
                  background: #2c3037; cursor: grab; touch-action: none; }
.scene3d .bar { display: flex; flex-wrap: wrap; gap: .5rem 1rem; margin: .5rem 0;
                font-size: .92rem; align-items: center; }
"""


@dataclass(frozen=True, slots=True, eq=False)
class SceneFrame:
    """One frame to show in 3D.

    Args:
        frame: What the camera measured.
        bodies: The people fitted to it.
        caption: A sentence about it.
    """

    frame: RgbdFrame
    bodies: Sequence[ShownBody]
    caption: str


def scene_html(scenes: Sequence[SceneFrame], f: Int[np.ndarray, 'm 3']) -> str:
    """Return the part of a page that shows frames in 3D; the page needs `scene_scripts` too.

    Args:
        scenes: At least one frame.
        f: Triangles of the bodies' meshes.
    """
    data = json.dumps(scene_data(scenes, f)).replace('</', '<\\/')
    return (
        f'<style>{STYLE}</style><figure class="scene3d">'
        f'<canvas aria-label="the scene in 3D: drag to turn, wheel to come nearer"></canvas>'
        f'<div class="bar"></div>'
        f'<input type="range" min="0" max="{len(scenes) - 1}" value="{len(scenes) // 2}" '
        f'aria-label="frame"{" hidden" if len(scenes) == 1 else ""}><figcaption></figcaption>'
        f'<script type="application/json">{data}</script></figure>')


def scene_scripts() -> str:
    """Return the scripts that bring 3D views to life: three.js and ours, for the page's end."""
    folder = files('pop_ros') / 'data'
    texts = [(folder / name).read_text('utf-8') for name in ('three.min.js', 'view3d.js')]
    return ''.join(f'<script>{text}</script>' for text in texts)


def scene_data(scenes: Sequence[SceneFrame], f: Int[np.ndarray, 'm 3']) -> dict[str, Any]:
    """Return what the script of the view reads."""
    center, radius = _place(scenes)
    return {
        'parents': list(PARENTS),
        'faces': _base64(f.astype('<u2')),
        'center': center.tolist(),
        'radius': radius,
        'frames': [_frame_data(scene) for scene in scenes],
    }


def _frame_data(scene: SceneFrame) -> dict[str, Any]:
    seen = undistort_frame(scene.frame)
    masks = [undistort_mask(body.mask, scene.frame.camera) for body in scene.bodies]
    people = np.any([np.zeros(seen.depth_m.shape, dtype=bool), *masks], axis=0)
    return {
        'caption': scene.caption,
        'room': _points(seen, ~people, scene.bodies),
        'people': _points(seen, people, scene.bodies),
        'bodies': [_body_data(body, index) for index, body in enumerate(scene.bodies)],
    }


def _body_data(body: ShownBody, index: int) -> dict[str, Any]:
    return {
        'color': 'rgb({},{},{})'.format(*body_color(body, index)),
        'vertices': _millimetres(body.vertices),
        'joints': _millimetres(body.joints),
        'states': body.joint_state.tolist(),
    }


def _points(
    frame: RgbdFrame, mask: Bool[np.ndarray, 'h w'], bodies: Sequence[ShownBody]
) -> dict[str, str]:
    """Return points of a mask near people with their colours, thinned evenly."""
    p_camera, uv = point_cloud(frame, mask)
    if bodies:
        corners = np.concatenate([body.joints for body in bodies])
        low, high = corners.min(axis=0) - NEAR_M, corners.max(axis=0) + NEAR_M
        near = ((p_camera > low) & (p_camera < high)).all(axis=1)
        p_camera, uv = p_camera[near], uv[near]
    chosen = np.linspace(0, len(uv) - 1, min(len(uv), MAX_POINTS)).astype(np.int64)
    columns, rows = uv[chosen].astype(np.int64).T
    return {'xyz': _millimetres(p_camera[chosen]), 'rgb': _base64(frame.rgb[rows, columns])}


def _place(scenes: Sequence[SceneFrame]) -> tuple[Float[np.ndarray, '3'], float]:
    """Return centre and half extent [m] of what the view should contain: the people."""
    shown = [body.vertices for scene in scenes for body in scene.bodies]
    if not shown:
        middle = scenes[0].frame
        everywhere = np.ones(middle.depth_m.shape, dtype=bool)
        cloud = point_cloud(undistort_frame(middle), everywhere)[0]
        shown = [np.percentile(cloud, [5, 95], axis=0)] if len(cloud) else [np.eye(3) + 1]
    low, high = np.concatenate(shown).min(axis=0), np.concatenate(shown).max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low) / 2)


def _millimetres(p_camera: Float[np.ndarray, 'n 3']) -> str:
    mm = np.clip(np.rint(p_camera * 1000), -32768, 32767)
    return _base64(mm.astype('<i2'))


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode('ascii')
