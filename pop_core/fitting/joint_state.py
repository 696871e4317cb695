"""How much of each joint of a fitted body the camera sees, from geometry alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.body.model import BodyModel
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.rendering.joint_visibility import pixels_of, states_at

SCENE_MARGIN_M = 0.06  # measured depth this much nearer than the body is something else


def fitted_joint_states(
    model: BodyModel,
    joints: Float[np.ndarray, '24 3'],
    rendered: RenderedDepth,
    depth_m: Float32[np.ndarray, 'h w'],
    camera: Camera,
) -> Int[np.ndarray, '24']:
    """Return a JointState per joint.

    Measured depth that agrees with the body, or lies behind it, hides nothing of it; a pixel
    without measurement leaves open what the camera saw there.

    Args:
        model: Body whose faces were rendered.
        joints: Joint positions [m], camera frame.
        rendered: Depth image of the body alone.
        depth_m: Measured depth of the same pixels [m]; NaN where nothing was measured.
        camera: Pinhole of both images.
    """
    inside, u, v = pixels_of(joints, camera)
    own_m, face, measured_m = rendered.depth_m[v, u], rendered.face[v, u], depth_m[v, u]
    part = np.where(face >= 0, model.bone_ids[model.f[face, 0], 0], -1)
    nearer = measured_m < own_m - SCENE_MARGIN_M
    others_m = np.where(nearer, measured_m, np.float32(np.inf))
    state = states_at(joints, inside, own_m, part, others_m)
    return np.where(inside & np.isnan(measured_m), int(JointState.UNKNOWN), state)
