"""How much of each joint the camera sees, from geometry alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.body.joints import JOINT_NAMES
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import RenderedDepth

# Depth of flesh in front of a joint [m], most of it over the front of an adult.
_THICKNESS_M = {
    'pelvis': 0.16, 'hip': 0.14, 'knee': 0.08, 'ankle': 0.07, 'foot': 0.06, 'spine1': 0.16,
    'spine2': 0.16, 'spine3': 0.17, 'neck': 0.11, 'head': 0.14, 'collar': 0.14, 'shoulder': 0.10,
    'elbow': 0.06, 'wrist': 0.05, 'hand': 0.05,
}
THICKNESS_M = np.array([_THICKNESS_M[name.split('_')[-1]] for name in JOINT_NAMES])
SCENE_MARGIN_M = 0.04


def joint_states(
    joints: Float[np.ndarray, '24 3'],
    rendered: RenderedDepth,
    depth_m: Float32[np.ndarray, 'h w'],
    camera: Camera,
) -> Int[np.ndarray, '24']:
    """Return a JointState per joint.

    A joint lies under skin: it is hidden when the nearest surface at its pixel is further in
    front of it than its flesh is thick. When the body's own front is that surface it is
    self-occluded, when the measured depth is nearer still the scene hides it. Where the scene
    hides what the body hides too, the scene is named: moving the furniture would not help less.

    Args:
        joints: Joint positions [m], camera frame.
        rendered: Depth image of the body alone.
        depth_m: Measured depth of the same pixels [m]; NaN where nothing was measured.
        camera: Pinhole of both images.
    """
    uv = np.rint(camera.project(joints))
    inside = np.isfinite(uv).all(axis=1)
    inside &= (uv >= 0).all(axis=1) & (uv < [camera.width, camera.height]).all(axis=1)
    u, v = np.where(inside[:, None], uv, 0).astype(np.int64).T
    surface = joints[:, 2] - THICKNESS_M
    front = rendered.depth_m[v, u].astype(np.float64)
    measured = depth_m[v, u].astype(np.float64)
    state = np.full(len(joints), int(JointState.VISIBLE))
    state[front < surface] = JointState.SELF_OCCLUDED
    with np.errstate(invalid='ignore'):
        nearest = np.minimum(front, surface)
        state[measured < nearest - SCENE_MARGIN_M] = JointState.SCENE_OCCLUDED
    state[np.isnan(measured)] = JointState.UNKNOWN
    state[~inside] = JointState.OUT_OF_IMAGE
    return state
