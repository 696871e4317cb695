"""How much of each joint of a fitted body the camera sees, from geometry alone."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.body.model import BodyModel
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.rendering.joint_visibility import joint_states

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
    part_of_face = np.append(model.bone_ids[model.f[:, 0], 0], -1)  # face -1 is no part
    nearer = depth_m < rendered.depth_m - SCENE_MARGIN_M
    others_m = np.where(nearer, depth_m, np.float32(np.inf))
    state = joint_states(
        joints, rendered.depth_m, part_of_face[rendered.face], others_m, camera)
    u, v = np.nan_to_num(np.rint(camera.project(joints)), nan=-1).astype(np.int64).T
    inside = state != JointState.OUT_OF_IMAGE
    unmeasured = np.zeros(len(joints), dtype=bool)
    unmeasured[inside] = np.isnan(depth_m[v[inside], u[inside]])
    return np.where(unmeasured, int(JointState.UNKNOWN), state)
