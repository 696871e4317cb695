"""What the sensor says of a person whose place is known: a tight window around the prediction."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from pop_core.body.joints import N_SHARED, SHARED
from pop_core.depth_noise import DepthNoise
from pop_core.estimate import JointState
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.body_window import body_window
from pop_core.fitting.observation import KeypointRays, Observation, Window, keypoint_rays
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.rgbd import RgbdFrame, flying_pixels
from pop_core.segmentation.ground import Ground

WINDOW_PX = 200  # longest side of the thinned window


def observe_track(
    frame: RgbdFrame, ground: Ground | None, others: Bool[np.ndarray, 'h w'],
    predicted: BodyState, joint_state: np.ndarray, lifted: LiftedJoints | None,
    *, noise: DepthNoise,
) -> Observation:
    """Return the observation of a tracked person.

    Args:
        frame: The undistorted frame.
        ground: The floor, if one is seen.
        noise: Noise of the measured depth.
        others: Pixels that nearer people explain.
        predicted: Where the person should be.
        joint_state: A JointState per joint, of the last frame.
        lifted: Joints detected in this frame, or None in frames without detection.
    """
    window = body_window(predicted.vertices, frame.camera, WINDOW_PX)
    camera = window.camera(frame.camera)
    rays = camera.ray_grid()
    depth_m = window.cut(frame.depth_m)
    dense = Window(window.left, window.top, window.width, window.height, 1)
    stride = window.stride
    flying = flying_pixels(dense.cut(frame.depth_m), frame.camera.fx)[::stride, ::stride]
    own = np.isfinite(depth_m) & ~window.cut(others) & ~flying
    if ground is not None:
        own &= ~ground.floor_pixels(depth_m, camera)
    if lifted is None:
        return Observation(
            window, camera, depth_m, rays, own, None, seen_joints(predicted, joint_state),
            _no_rays(), ground, noise)
    lifted = lifted.without_guesses()
    return Observation(
        window, camera, depth_m, rays, own, None, lifted, keypoint_rays(lifted, frame.camera),
        ground, noise)


def seen_joints(predicted: BodyState, joint_state: np.ndarray) -> LiftedJoints:
    """Return the predicted shared joints, lifted where they were seen last.

    They tell the floor which feet stand where the surface puts them; they pull on nothing.
    """
    seen = np.isin(joint_state[SHARED], [JointState.VISIBLE, JointState.UNKNOWN])
    return LiftedJoints(
        np.where(seen[:, None], predicted.landmarks, np.nan),
        np.where(seen, 1.0, np.inf),
        np.where(seen, int(LiftState.VISIBLE), int(LiftState.MISSING)),
        np.full((N_SHARED, 2), np.nan), np.zeros(N_SHARED))


def _no_rays() -> KeypointRays:
    return KeypointRays(np.zeros(0, dtype=np.int64), np.zeros((0, 2, 3)), np.zeros(0), 1.0)
