"""Lift 2D keypoints to joint centres in the camera frame [m] using registered depth (step 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.geometry.camera import Camera
from pop_core.keypoints.bone_evidence import MeasuredBones, depths_along_bones
from pop_core.keypoints.depth_layers import DepthLayers, find_layers
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.joint_depths import (
    JointLayers,
    choose_depths,
    hidden_price,
    layer_prices,
    nearest_layer,
)
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.keypoints.skeleton import BONE_M, TREE_PARENT, linked
from pop_core.keypoints.skeleton_checks import (
    with_guessed_limbs,
    without_broken_bones,
    without_guessed_nose,
    without_hidden_limbs,
)
from pop_core.keypoints.skin_offsets import facing, skin_to_joint_m
from pop_core.rgbd import RgbdFrame
from pop_core.settings import setting

SMALLEST, LARGEST = 0.5, 1.15  # people relative to the default body
# A joint lies behind a surface within some standard deviations, and within bounds in metres.
GATE, GATE_BOUNDS_M = 2.5, (0.08, 0.25)
VGA_WIDTH = 640


@dataclass(frozen=True, slots=True)
class LiftingConfig:
    """Settings of `lift_keypoints`."""

    min_score: float = setting(
        0.1, minimum=0.0, maximum=1.0, about='Keypoints of a lower score count as undetected.')
    patch_radius_m: float = setting(
        0.05, unit='m', minimum=0.005, maximum=0.15,
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
    doubt_m: float = setting(
        0.25, unit='m', minimum=0.0, maximum=1.0,
        about='Standard deviation added to a keypoint of score 0; it falls with (1 - score)^2.')


def lift_keypoints(
    frame: RgbdFrame, detection: Detection, config: LiftingConfig | None = None,
    expected: JointBelief | None = None,
) -> LiftedJoints:
    """Return each keypoint as a joint in 3D, or the reason why it has none (step 3: J_3D).

    Depth reads skin; the joint lies some centimetres further along the ray. Surfaces that the
    skeleton cannot reach are occluders (nearer) or background (farther), and are never lifted
    onto.

    Args:
        frame: Colour and depth without lens distortion.
        detection: One person; depth, visibility and mask are used where the source gives them.
        config: Settings; None takes the defaults.
        expected: Where the joints are expected: of several surfaces the one near that is likelier.
    """
    config = config or LiftingConfig()
    keypoints_px, scores = _detected(detection, config.min_score)
    usable = _inside(keypoints_px, frame.camera)
    pixels = np.where(usable[:, None], keypoints_px, np.nan)
    mask = detection.person_mask
    layers = find_layers(
        frame.depth_m, np.ones(frame.depth_m.shape, bool) if mask is None else mask, pixels,
        config.patch_radius_m * frame.camera.fx, config.layer_gap)
    rays = frame.camera.unproject(pixels, np.ones(len(pixels)))[:, :2]
    links = linked(layers.known)
    prices = layer_prices(frame.depth_m, pixels, layers, links, config.layer_gap)
    bones = MeasuredBones(links, depths_along_bones(
        frame.depth_m, pixels, links, frame.camera.fx / layers.middle_m))
    position = np.full((len(pixels), 3), np.nan)
    sigma_m = np.full(len(pixels), np.inf)
    state = np.full(len(pixels), int(LiftState.MISSING))
    if layers.known.any():
        position, sigma_m, state = _lift(
            _View(frame, pixels, rays, scores, layers, prices, bones, expected), config)
    lifted = LiftedJoints(position, sigma_m, state, keypoints_px, scores)
    return _with_given(detection, frame.camera, lifted)


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


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """What is known of one person before its size and facing are."""

    frame: RgbdFrame
    pixels: Float[np.ndarray, 's 2']
    rays: Float[np.ndarray, 's 2']
    scores: Float[np.ndarray, 's']
    layers: DepthLayers
    prices: Float[np.ndarray, 's l']
    bones: MeasuredBones
    expected: JointBelief | None


def _lift(
    view: _View, config: LiftingConfig
) -> tuple[Float[np.ndarray, 's 3'], Float[np.ndarray, 's'], Int[np.ndarray, 's']]:
    """Return positions, sigmas and states of keypoints with surfaces under them.

    A first pass finds the person; a second one uses the person's size and facing.
    """
    scale, facing_share = 1.0, None
    rows = np.arange(len(view.scores))
    for _ in range(2):
        joints = _behind_skin(view, scale, facing_share, config)
        depth_m = choose_depths(
            joints, view.rays, view.scores, view.bones, scale, config.stretch,
            expected=view.expected)
        chosen = nearest_layer(joints, depth_m)
        state = _states(joints, depth_m, chosen, view.scores)
        at_joint = joints.depth_m[rows, chosen]
        position = np.column_stack([view.rays * at_joint[:, None], at_joint])
        scale = _size(position, state == LiftState.VISIBLE)
        metres_per_px = float(np.nanmedian(depth_m)) / view.frame.camera.fx
        facing_share = facing(view.pixels, metres_per_px / scale)
    state = without_broken_bones(position, view.scores, state, scale * config.stretch)
    state = without_hidden_limbs(position, view.scores, state, scale)
    state = without_guessed_nose(view.scores, state, facing_share)
    state = with_guessed_limbs(view.scores, state)
    visible = np.isin(state, [LiftState.VISIBLE, LiftState.GUESSED])
    position = np.where(visible[:, None], position, np.nan)
    sigma_m = _sigma_m(view, joints.sigma_m[rows, chosen], at_joint, config)
    return position, np.where(visible, sigma_m, np.inf), state


def _behind_skin(
    view: _View, scale: float, facing_share: float | None, config: LiftingConfig
) -> JointLayers:
    """Return where each joint lies behind each surface, for a person of that size."""
    layers = view.layers
    offset_m, spread_m = skin_to_joint_m(facing_share)
    obliqueness = np.sqrt(1.0 + np.nan_to_num(view.rays**2).sum(axis=1))
    offset_z = scale * offset_m / obliqueness
    noise = config.depth_noise * layers.depth_m**2
    sigma_m = np.sqrt((scale * spread_m[:, None]) ** 2 + noise**2 + layers.spread_m**2)
    return JointLayers(
        layers, layers.depth_m + offset_z[:, None], np.maximum(sigma_m, 0.005), view.prices,
        offset_z)


def _sigma_m(
    view: _View,
    along: Float[np.ndarray, 's'],
    depth_m: Float[np.ndarray, 's'],
    config: LiftingConfig,
) -> Float[np.ndarray, 's']:
    """Return the standard deviation of each position, the same along every axis [m].

    It is the root mean square of the error along the ray and the two across it, and the doubt
    whether the keypoint is there at all.
    """
    camera = view.frame.camera
    across = config.keypoint_sigma_px * camera.width / VGA_WIDTH * depth_m / camera.fx
    doubt = config.doubt_m * (1.0 - view.scores) ** 2
    return np.sqrt((along**2 + 2.0 * across**2) / 3.0 + doubt**2)


def _states(
    joints: JointLayers, depth_m: Float[np.ndarray, 's'], chosen: Int[np.ndarray, 's'],
    scores: Float[np.ndarray, 's'],
) -> Int[np.ndarray, 's']:
    """Return the state of each joint at its most probable depth [m]."""
    rows = np.arange(len(depth_m))
    at_layer, sigma_m = joints.depth_m[rows, chosen], joints.sigma_m[rows, chosen]
    present = joints.layers.present
    with np.errstate(invalid='ignore'):
        fits = np.abs(depth_m - at_layer) <= np.clip(GATE * sigma_m, *GATE_BOUNDS_M)
        # Close behind an occluder is behind it.
        hidden = hidden_price(joints.layers, scores) < joints.price
        hidden = hidden[rows, chosen] & (depth_m > at_layer)
        nearer = np.any(present & (joints.depth_m < depth_m[:, None]), axis=1)
    state = np.where(nearer, int(LiftState.OCCLUDED), int(LiftState.OUTLIER))
    state = np.where(fits & ~hidden, int(LiftState.VISIBLE), state)
    return np.where(joints.layers.known, state, int(LiftState.MISSING))


def _size(position: Float[np.ndarray, 's 3'], visible: Bool[np.ndarray, 's']) -> float:
    """Return the person's size relative to the default body, by the median of visible bones."""
    known = visible & visible[TREE_PARENT] & (TREE_PARENT >= 0)
    if np.count_nonzero(known) < 4:
        return 1.0
    length = np.linalg.norm(position - position[TREE_PARENT], axis=1)
    return float(np.clip(np.median(length[known] / BONE_M[known]), SMALLEST, LARGEST))


def _with_given(detection: Detection, camera: Camera, lifted: LiftedJoints) -> LiftedJoints:
    """Return joints with what the source itself says about their visibility and depth.

    A source that knows joints behind occluders gives hidden ones a position, too.
    """
    position, sigma_m = lifted.positions_camera.copy(), lifted.sigma_m.copy()
    state = lifted.state.copy()
    found = np.isfinite(lifted.keypoints_px).all(axis=1)
    if detection.visible is not None:
        hidden = found & (detection.visible < 0.5)
        state[hidden] = LiftState.OCCLUDED
        position[hidden], sigma_m[hidden] = np.nan, np.inf
    if detection.joint_depth_m is not None and detection.joint_sigma_m is not None:
        given = found & np.isfinite(detection.joint_depth_m)
        position[given] = camera.unproject(
            lifted.keypoints_px[given], detection.joint_depth_m[given])
        sigma_m[given] = detection.joint_sigma_m[given]
        state[given & (state != LiftState.OCCLUDED)] = LiftState.VISIBLE
    return LiftedJoints(position, sigma_m, state, lifted.keypoints_px, lifted.scores)
