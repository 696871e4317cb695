"""Which joints of a person the camera sees, from the truth of a scene."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import JOINT_INDEX, N_JOINTS, PARENTS, SHARED, SHARED_INDEX
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera

LIMB_M, HIP_M, TRUNK_M = 0.20, 0.25, 0.32  # deepest that a joint lies behind its own skin
NOSE_M = 0.025


def joint_states(
    joints: Float[np.ndarray, '24 3'],
    own_depth_m: Float[np.ndarray, 'h w'], own_part: Int[np.ndarray, 'h w'],
    others_depth_m: Float[np.ndarray, 'h w'], camera: Camera,
) -> Int[np.ndarray, '24']:
    """Return a JointState per joint.

    A joint is seen when the ray toward it meets the person's own body first, on a part next to
    the joint and not far in front of it.

    Args:
        joints: Joint centres, camera frame [m].
        own_depth_m: Depth of this person alone; +inf where not covered.
        own_part: Joint that moves the surface seen there, -1 where not covered.
        others_depth_m: Depth of everything but this person; +inf where empty.
        camera: Camera without distortion.
    """
    inside, u, v = pixels_of(joints, camera)
    return states_at(joints, inside, own_depth_m[v, u], own_part[v, u], others_depth_m[v, u])


def states_at(
    joints: Float[np.ndarray, '24 3'], inside: Bool[np.ndarray, '24'],
    own: Float[np.ndarray, '24'], part: Int[np.ndarray, '24'], others: Float[np.ndarray, '24'],
) -> Int[np.ndarray, '24']:
    """Return a JointState per joint, from what is seen at the pixel of each.

    Args:
        joints: Joint centres, camera frame [m].
        inside: Whether the pixel lies in the image.
        own: Depth of this person alone [m]; +inf where not covered.
        part: Joint that moves the surface seen there, -1 where not covered.
        others: Depth of everything but this person [m]; +inf where empty.
    """
    state = np.full(N_JOINTS, JointState.OUT_OF_IMAGE, dtype=np.int64)
    near_skin = joints[:, 2] - own < _deepest()
    with_skin = np.isfinite(own) & _NEXT_TO[np.arange(N_JOINTS), part] & near_skin
    # At the rim a joint's pixel may just miss the body: then the joint itself is what is hidden.
    front = np.where(np.isfinite(own), np.minimum(own, joints[:, 2]), joints[:, 2])
    seen = np.where(with_skin | ~np.isfinite(own), JointState.VISIBLE, JointState.SELF_OCCLUDED)
    state[inside] = np.where(others < front, JointState.SCENE_OCCLUDED, seen)[inside]
    return state


def shared_states(
    states: Int[np.ndarray, '24'], nose: Float[np.ndarray, '3'],
    own_depth_m: Float[np.ndarray, 'h w'], others_depth_m: Float[np.ndarray, 'h w'],
    camera: Camera,
) -> Int[np.ndarray, '15']:
    """Return a JointState per shared point; the head's is that of the nose, a skin point."""
    out = states[SHARED].copy()
    row = SHARED_INDEX['head']
    inside, u, v = pixels_of(nose[None], camera)
    if not inside[0]:
        out[row] = JointState.OUT_OF_IMAGE
    elif nose[2] > others_depth_m[v[0], u[0]]:
        out[row] = JointState.SCENE_OCCLUDED
    elif nose[2] - own_depth_m[v[0], u[0]] > NOSE_M:
        out[row] = JointState.SELF_OCCLUDED
    else:
        out[row] = JointState.VISIBLE
    return out


def pixels_of(
    p_camera: Float[np.ndarray, 'n 3'], camera: Camera
) -> tuple[Bool[np.ndarray, 'n'], Int[np.ndarray, 'n'], Int[np.ndarray, 'n']]:
    """Return which points fall into the image, and their pixels (0, 0 for the others)."""
    uv = np.nan_to_num(camera.project(p_camera), nan=-1e6)
    u, v = np.rint(uv).astype(np.int64).T
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    return inside, np.where(inside, u, 0), np.where(inside, v, 0)


def _neighbours() -> Bool[np.ndarray, '24 25']:
    """Return which parts may cover which joint and still be its own skin; column -1 is no part."""
    near = np.eye(N_JOINTS, N_JOINTS + 1, dtype=bool)
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            near[child, parent] = near[parent, child] = True
    trunk = [JOINT_INDEX[name] for name in (
        'pelvis', 'spine1', 'spine2', 'spine3', 'left_collar', 'right_collar', 'neck')]
    near[np.ix_(trunk, trunk)] = True
    for name in ('left_shoulder', 'right_shoulder', 'left_hip', 'right_hip'):
        near[JOINT_INDEX[name], trunk] = True
        near[trunk, JOINT_INDEX[name]] = True
    return near


def _deepest() -> Float[np.ndarray, '24']:
    """Return how far in front of each joint its own skin may be [m]: measured on stout bodies."""
    out = np.full(N_JOINTS, LIMB_M)
    for name in ('pelvis', 'spine1', 'spine2', 'spine3', 'left_collar', 'right_collar', 'neck'):
        out[JOINT_INDEX[name]] = TRUNK_M
    out[[JOINT_INDEX['left_hip'], JOINT_INDEX['right_hip']]] = HIP_M
    return out


_NEXT_TO = _neighbours()
