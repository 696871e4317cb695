"""Measure how far joints lie behind the skin: prints the table of keypoints/skin_offsets.py.

    python scripts/measure_skin_offsets.py [BODIES]

Clothed default bodies in varied poses are rendered alone from random sides. The depth at each
joint that the camera sees is compared with the joint itself, along the ray, at scale 1. Offsets
for front, side and back are the least absolute deviations over the facing of each view.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.joints import SHARED_NAMES
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, shared_points
from pop_core.estimate import JointState
from pop_core.geometry.transform import transform_points
from pop_core.keypoints.skin_offsets import facing
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rendering.joint_visibility import joint_states, shared_states
from pop_core.synthesis.cameras import CameraRange, draw_camera
from pop_core.synthesis.layouts import SceneConfig
from pop_core.synthesis.people import actor_at, draw_actor, moved_parameters

PATCH_M = 0.03
NOSE_ROW = SHARED_NAMES.index('head')


def measure(model: BodyModel, seed: int) -> list[tuple[str, float, float]]:
    """Return (joint without side, facing, offset [m]) of what one view of one body shows."""
    rng = np.random.default_rng([seed, 99])
    kinds, shares = zip(*SceneConfig().pose_shares, strict=True)
    actor = draw_actor(model, str(rng.choice(kinds, p=shares)), rng)
    actor = actor_at(actor, model, np.zeros(3), float(rng.uniform(-np.pi, np.pi)))
    centre = joints(model, actor.parameters).mean(axis=0)
    camera, T_camera_room = draw_camera(centre, CameraRange(), rng)
    parameters = moved_parameters(model, actor.parameters, T_camera_room)
    points = attached_positions(shared_points(model), model, parameters)
    image = render_depth(transform_points(T_camera_room, actor.surface), model.f, camera)
    part = np.append(model.weights[model.f].sum(axis=1).argmax(axis=1), -1)[image.face]
    nothing = np.full_like(image.depth_m, np.inf)
    states = shared_states(
        joint_states(joints(model, parameters), image.depth_m, part, nothing, camera),
        points[NOSE_ROW], image.depth_m, nothing, camera)
    uv = camera.project(points)
    turned = facing(uv, float(points[0, 2]) / camera.fx / parameters.scale)
    rows = []
    for j in np.flatnonzero(states == JointState.VISIBLE):
        radius = round(PATCH_M * camera.fx / points[j, 2])
        u, v = np.rint(uv[j]).astype(int)
        patch = image.depth_m[max(v - radius, 0): v + radius + 1,
                              max(u - radius, 0): u + radius + 1]
        skin = np.median(patch[np.isfinite(patch)])
        along = np.linalg.norm(points[j]) / points[j, 2]
        offset_m = float((points[j, 2] - skin) * along / parameters.scale)
        rows.append((SHARED_NAMES[j].split('_')[-1], float(turned or 0.0), offset_m))
    return rows


def fit_offsets(facings: np.ndarray, offsets_m: np.ndarray) -> tuple[np.ndarray, float]:
    """Return offsets at front, side and back, and the robust spread about them [m]."""
    weights = np.stack([
        np.maximum(facings, 0), 1 - np.abs(facings), np.maximum(-facings, 0)], axis=1)
    x = np.linalg.lstsq(weights, offsets_m, rcond=None)[0]
    for _ in range(30):  # least absolute deviations by reweighting
        pull = 1.0 / np.sqrt(np.maximum(np.abs(offsets_m - weights @ x), 1e-3))
        x = np.linalg.lstsq(weights * pull[:, None], offsets_m * pull, rcond=None)[0]
    return x, 1.4826 * float(np.median(np.abs(offsets_m - weights @ x)))


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 600
    model = default_body()
    found: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for seed in range(count):
        for name, turned, offset_m in measure(model, seed):
            found[name].append((turned, offset_m))
    for name, rows in found.items():
        facings, offsets_m = np.array(rows).T
        x, spread_m = fit_offsets(facings, offsets_m)
        print(f"    '{name}': ({x[0]:.3f}, {x[1]:.3f}, {x[2]:.3f}, {spread_m:.3f}),"
              f'  # {len(rows)} views')


if __name__ == '__main__':
    main()
