"""Lift 2D keypoints to joint centres in the camera frame [m] using registered depth (step 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.geometry.camera import Camera
from pop_core.keypoints.depth_layers import DepthLayers, find_layers
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.joint_depths import JointLayers, choose_depths, nearest_layer
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.keypoints.skeleton import BONE_M, TREE_PARENT
from pop_core.keypoints.skin_offsets import facing, skin_to_joint_m
from pop_core.rgbd import RgbdFrame
from pop_core.settings import setting

SMALLEST, LARGEST = 0.5, 1.15  # people relative to the default body
GATE = 3.0  # standard deviations within which a joint lies behind a surface
VGA_WIDTH = 640


@dataclass(frozen=True, slots=True)
class LiftingConfig:
    """Settings of `lift_keypoints`."""

    min_score: float = setting(
        0.1, minimum=0.0, maximum=1.0, about='Keypoints of a lower score count as undetected.')
    patch_radius_m: float = setting(
        0.035, unit='m', minimum=0.005, maximum=0.15,
        about='Radius of the patch of depth read around a keypoint, at the person.')
    layer_gap: float = setting(
        0.025, minimum=0.005, maximum=0.2,
        about='Jump of depth that separates two surfaces, as a share of depth.')
    keypoint_sigma_px: float = setting(
        4.0, unit='px', minimum=0.0, maximum=50.0,
        about='Error of keypoints in an image 640 pixels wide, standard deviation.')
    depth_noise: float = setting(
        0.0025, unit='1/m', minimum=0.0, maximum=0.05,
        about='Depth noise divided by squared depth; 0.0025 is 1 cm at 2 m.')
    stretch: float = setting(
        1.25, minimum=1.0, maximum=2.0,
        about='Longest bone accepted, relative to the mean bone of a body of that size.')


def lift_keypoints(
    frame: RgbdFrame, detection: Detection, config: LiftingConfig | None = None
) -> LiftedJoints:
    """Return each keypoint as a joint in 3D, or the reason why it has no position.

    Depth reads skin; the joint lies some centimetres further along the ray. Surfaces that the
    skeleton cannot reach are occluders (nearer) or background (farther), and are never lifted
    onto.

    Args:
        frame: Colour and depth without lens distortion.
        detection: One person; depth, visibility and mask are used where the source gives them.
        config: Settings; None takes the defaults.
    """
    config = config or LiftingConfig()
    keypoints_px, scores = _detected(detection, config.min_score)
    usable = _inside(keypoints_px, frame.camera)
    pixels = np.where(usable[:, None], keypoints_px, np.nan)
    mask = detection.person_mask
    layers = find_layers(
        frame.depth_m, np.ones(frame.depth_m.shape, bool) if mask is None else mask, pixels,
        config.patch_radius_m * frame.camera.fx, config.layer_gap)
    position = np.full((len(pixels), 3), np.nan)
    sigma_m = np.full(len(pixels), np.inf)
    state = np.full(len(pixels), int(LiftState.MISSING))
    if layers.present.any():
        position, sigma_m, state = _lift(frame.camera, pixels, scores, layers, config)
    _take_given(detection, frame.camera, keypoints_px, position, sigma_m, state)
    return LiftedJoints(position, sigma_m, state, keypoints_px, scores)


def _detected(
    detection: Detection, min_score: float
) -> tuple[Float[np.ndarray, 's 2'], Float[np.ndarray, 's']]:
    found = np.isfinite(detection.keypoints_px).all(axis=1) & (detection.scores > 0)
    found &= detection.scores >= min_score
    keypoints_px = np.where(found[:, None], detection.keypoints_px, np.nan)
    return keypoints_px, np.where(found, detection.scores, 0.0)


def _inside(uv: Float[np.ndarray, 's 2'], camera: Camera) -> Bool[np.ndarray, 's']:
    size = np.array([camera.width, camera.height]) - 0.5
    with np.errstate(invalid='ignore'):
        return np.all((uv >= -0.5) & (uv <= size), axis=1)


def _lift(
    camera: Camera,
    pixels: Float[np.ndarray, 's 2'],
    scores: Float[np.ndarray, 's'],
    layers: DepthLayers,
    config: LiftingConfig,
) -> tuple[Float[np.ndarray, 's 3'], Float[np.ndarray, 's'], Int[np.ndarray, 's']]:
    """Return positions, sigmas and states of keypoints with surfaces under them.

    A first pass finds the person; a second one uses the person's size and facing.
    """
    rays = camera.unproject(pixels, np.ones(len(pixels)))[:, :2]
    scale, facing_share = 1.0, None
    for _ in range(2):
        joints = _behind_skin(camera, rays, layers, scale, facing_share, config)
        depth_m = choose_depths(joints, rays, scores, scale, config.stretch)
        chosen = nearest_layer(joints, depth_m)
        state = _states(joints, depth_m, chosen)
        rows = np.arange(len(pixels))
        skin_side = joints.depth_m[rows, chosen]
        position = np.column_stack([rays * skin_side[:, None], skin_side])
        scale = _size(position, state == LiftState.VISIBLE)
        facing_share = facing(pixels, float(np.median(depth_m)) / camera.fx / scale)
    state = _without_broken_bones(position, scores, state, scale * config.stretch)
    visible = state == LiftState.VISIBLE
    position = np.where(visible[:, None], position, np.nan)
    across = config.keypoint_sigma_px * camera.width / VGA_WIDTH * skin_side / camera.fx
    sigma_m = np.where(visible, np.hypot(joints.sigma_m[rows, chosen], across), np.inf)
    return position, sigma_m, state


def _behind_skin(
    camera: Camera,
    rays: Float[np.ndarray, 's 2'],
    layers: DepthLayers,
    scale: float,
    facing_share: float | None,
    config: LiftingConfig,
) -> JointLayers:
    """Return where each joint lies behind each surface, for a person of that size."""
    offset_m, spread_m = skin_to_joint_m(facing_share)
    obliqueness = np.sqrt(1.0 + np.nan_to_num(rays**2).sum(axis=1))
    offset_z = (scale * offset_m / obliqueness)[:, None]
    noise = config.depth_noise * layers.depth_m**2
    sigma_m = np.sqrt((scale * spread_m[:, None]) ** 2 + noise**2 + layers.spread_m**2)
    return JointLayers(layers, layers.depth_m + offset_z, np.maximum(sigma_m, 0.005))


def _states(
    joints: JointLayers, depth_m: Float[np.ndarray, 's'], chosen: Int[np.ndarray, 's']
) -> Int[np.ndarray, 's']:
    """Return the state of each joint at its most probable depth [m]."""
    rows = np.arange(len(depth_m))
    at_layer, sigma_m = joints.depth_m[rows, chosen], joints.sigma_m[rows, chosen]
    present = joints.layers.present
    fits = np.abs(depth_m - at_layer) <= GATE * sigma_m
    nearer = np.any(present & (joints.depth_m < depth_m[:, None]), axis=1)
    state = np.where(nearer, int(LiftState.OCCLUDED), int(LiftState.OUTLIER))
    state = np.where(fits, int(LiftState.VISIBLE), state)
    return np.where(present.any(axis=1), state, int(LiftState.MISSING))


def _size(position: Float[np.ndarray, 's 3'], visible: Bool[np.ndarray, 's']) -> float:
    """Return the person's size relative to the default body, by the median of visible bones."""
    parent = position[TREE_PARENT]
    known = visible & visible[TREE_PARENT] & (TREE_PARENT >= 0)
    if np.count_nonzero(known) < 4:
        return 1.0
    ratio = np.linalg.norm(position - parent, axis=1)[known] / BONE_M[known]
    return float(np.clip(np.median(ratio), SMALLEST, LARGEST))


def _without_broken_bones(
    position: Float[np.ndarray, 's 3'],
    scores: Float[np.ndarray, 's'],
    state: Int[np.ndarray, 's'],
    longest: float,
) -> Int[np.ndarray, 's']:
    """Return states in which no two visible neighbours are farther apart than a bone is long.

    Of a broken bone's ends, the one with more broken bones is wrong, then the less certain one.
    """
    state = state.copy()
    child = np.flatnonzero(TREE_PARENT >= 0)
    parent = TREE_PARENT[child]
    length = np.linalg.norm(position[child] - position[parent], axis=1)
    too_long = length > BONE_M[child] * longest + 0.1
    while True:
        visible = state == LiftState.VISIBLE
        broken = too_long & visible[child] & visible[parent]
        if not broken.any():
            return state
        blame = np.bincount(child[broken], minlength=len(state)).astype(np.float64)
        blame += np.bincount(parent[broken], minlength=len(state))
        state[np.argmax(np.where(blame > 0, blame - scores, -np.inf))] = LiftState.OUTLIER


def _take_given(
    detection: Detection,
    camera: Camera,
    keypoints_px: Float[np.ndarray, 's 2'],
    position: Float[np.ndarray, 's 3'],
    sigma_m: Float[np.ndarray, 's'],
    state: Int[np.ndarray, 's'],
) -> None:
    """Write over what the source itself says about depth and visibility of joints."""
    found = np.isfinite(keypoints_px).all(axis=1)
    if detection.visible is not None:
        hidden = found & (detection.visible < 0.5)
        state[hidden] = LiftState.OCCLUDED
        position[hidden], sigma_m[hidden] = np.nan, np.inf
    if detection.joint_depth_m is not None and detection.joint_sigma_m is not None:
        given = found & np.isfinite(detection.joint_depth_m)
        position[given] = camera.unproject(keypoints_px, detection.joint_depth_m)[given]
        sigma_m[given] = detection.joint_sigma_m[given]
        seen = given & (state != LiftState.OCCLUDED)
        state[seen] = LiftState.VISIBLE
