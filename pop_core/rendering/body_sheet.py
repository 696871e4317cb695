"""One picture of a body model: T-pose from all sides, each beta at -2 and +2, posed examples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int, UInt8

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel, rest_parameters
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec
from pop_core.rendering.palette import PAPER
from pop_core.rendering.shading import shade
from pop_core.rendering.text import captioned

SKIN = (222, 206, 186)
PIXELS_PER_METRE = 190
ROW_HEIGHT_M = 2.4
VIEWER_M = 40.0  # far off: bodies are compared, perspective would favour the near parts
VIEW_FROM_FRONT = np.diag([1.0, -1.0, -1.0])

Pose = Mapping[str, tuple[float, float, float]]
ARMS_DOWN: Pose = {'left_shoulder': (0.0, 0.0, -70.0), 'right_shoulder': (0.0, 0.0, 70.0)}
# Rotation vectors in degrees: right angles show where skinning pinches.
POSES: dict[str, Pose] = {
    'arms down': ARMS_DOWN,
    'elbows 90': {'left_elbow': (0.0, -90.0, 0.0), 'right_elbow': (0.0, 90.0, 0.0)},
    'arms up': {'left_shoulder': (0.0, 0.0, 80.0), 'right_shoulder': (0.0, 0.0, -80.0)},
    'knees 90': {'left_knee': (90.0, 0.0, 0.0), 'right_knee': (90.0, 0.0, 0.0)},
    'seated': {
        **ARMS_DOWN, 'left_hip': (-90.0, 0.0, 0.0), 'right_hip': (-90.0, 0.0, 0.0),
        'left_knee': (90.0, 0.0, 0.0), 'right_knee': (90.0, 0.0, 0.0),
    },
    'bent': {
        **ARMS_DOWN, 'spine1': (30.0, 0.0, 0.0), 'spine2': (30.0, 0.0, 0.0),
        'spine3': (20.0, 0.0, 0.0),
    },
}


def draw_body_sheet(model: BodyModel) -> UInt8[np.ndarray, 'h w 3']:
    """Return the picture of a body model, rows of captioned bodies to one scale."""
    betas = range(model.n_betas)
    rows = [
        _tpose_row(model),
        *(_beta_row(model, betas[first: first + 5]) for first in betas[::5]),
        _pose_row(model),
    ]
    width = max(row.shape[1] for row in rows)
    return np.concatenate([_widened(row, width) for row in rows])


def _tpose_row(model: BodyModel) -> UInt8[np.ndarray, 'h w 3']:
    rest, thin = model.v_template, model.v_template[model.fit_vertices]
    return _row([
        captioned(_drawn(rest, model.f, 0.0, 2.0), 'T-pose'),
        captioned(_drawn(rest, model.f, 90.0, 1.0), 'from its right'),
        captioned(_drawn(rest, model.f, 180.0, 2.0), 'from behind'),
        captioned(_drawn(thin, model.fit_faces, 0.0, 2.0), f'fitting mesh, {len(thin)}'),
    ])


def _beta_row(model: BodyModel, betas: Sequence[int]) -> UInt8[np.ndarray, 'h w 3']:
    panels = []
    for beta in betas:
        pair = []
        for sigma in (-2.0, 2.0):
            shape = np.zeros(model.n_betas)
            shape[beta] = sigma
            pair.append(_drawn(_posed(model, ARMS_DOWN, shape), model.f, 20.0, 0.95))
        panels.append(captioned(_row(pair), f'beta {beta + 1}: -2, +2'))
    return _row(panels)


def _pose_row(model: BodyModel) -> UInt8[np.ndarray, 'h w 3']:
    mean = np.zeros(model.n_betas)
    return _row([
        captioned(_drawn(_posed(model, pose, mean), model.f, 50.0, 1.25), name)
        for name, pose in POSES.items()
    ])


def _posed(
    model: BodyModel, pose: Pose, betas: Float[np.ndarray, 'b']
) -> Float[np.ndarray, 'v 3']:
    body_pose = np.zeros((23, 3))
    for joint, rotvec_deg in pose.items():
        body_pose[JOINT_INDEX[joint] - 1] = np.deg2rad(rotvec_deg)
    rest = rest_parameters(model.n_betas)
    return vertices(model, rest.replaced(body_pose=body_pose, betas=betas))


def _drawn(
    body: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3'], turn_deg: float, width_m: float
) -> UInt8[np.ndarray, 'h w 3']:
    """Draw a body of the body frame, turned about the vertical, in the middle of a panel."""
    width, height = round(width_m * PIXELS_PER_METRE), round(ROW_HEIGHT_M * PIXELS_PER_METRE)
    focal = PIXELS_PER_METRE * VIEWER_M
    camera = Camera(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)
    turned = body @ from_rotvec(np.array([0.0, np.deg2rad(turn_deg), 0.0])).T
    centred = turned - (turned.min(axis=0) + turned.max(axis=0)) / 2
    seen = centred @ VIEW_FROM_FRONT.T + [0, 0, VIEWER_M]
    rendered, shaded = shade(seen, f, camera, SKIN)
    return np.where(rendered.covered[..., None], shaded, np.array(PAPER)).astype(np.uint8)


def _row(panels: Sequence[UInt8[np.ndarray, 'h _ 3']]) -> UInt8[np.ndarray, 'h w 3']:
    return np.concatenate(list(panels), axis=1)


def _widened(row: UInt8[np.ndarray, 'h a 3'], width: int) -> UInt8[np.ndarray, 'h b 3']:
    out = np.full((row.shape[0], width, 3), PAPER, dtype=np.uint8)
    out[:, : row.shape[1]] = row
    return out
