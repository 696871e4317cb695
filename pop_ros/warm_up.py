"""Compile kernels and touch the library before the first real frame arrives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float32

from pop_core.body.joints import SHARED_NAMES
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, rest_parameters, shared_points
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.region import RegionConfig
from pop_core.pipeline import BodyPipeline
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rgbd import RgbdFrame
from pop_ros.keypoint_sources import depth_networks

CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
WALL_M = 4.0
UNMEASURED, HOLE_PX = 'left_wrist', 12
PLACE = np.array([0.0, 0.0, 2.5])
FACING_CAMERA = np.array([np.pi, 0.0, 0.0])


class OnePerson:
    """The keypoints of one known person."""

    def __init__(self, detection: Detection) -> None:
        """Take the person."""
        self._detection = detection

    def detect(self, _frame: RgbdFrame) -> list[Detection]:
        """Return the person."""
        return [self._detection]


def warm_up(pipeline: BodyPipeline) -> None:
    """Find and fit a small synthetic person once, so that no real frame pays for compilation."""
    frame, detection = small_scene(pipeline.model)
    for network in depth_networks(pipeline.detector):
        network.detect(frame)
    # Whatever the region of interest, this person must be fitted.
    config = replace(pipeline.config, region=RegionConfig(), max_range_m=2 * PLACE[2])
    BodyPipeline(
        pipeline.model, pipeline.library, OnePerson(detection), config, pipeline.fitter.prior,
        pipeline.completion,
    ).process(frame)


def small_scene(model: BodyModel) -> tuple[RgbdFrame, Detection]:
    """Return a frame of the body model on a floor before a wall, and its keypoints.

    Depth has a hole where one of them lies: whatever a real frame asks for is asked for here.
    """
    parameters = rest_parameters(model.n_betas).replaced(
        global_orient=FACING_CAMERA, transl=PLACE)
    surface = vertices(model, parameters)
    depth_m = np.minimum(
        render_depth(surface, model.f, CAMERA).depth_m, _room(float(surface[:, 1].max())))
    rgb = np.full((CAMERA.height, CAMERA.width, 3), 128, dtype=np.uint8)
    uv = CAMERA.project(attached_positions(shared_points(model), model, parameters))
    u, v = np.rint(uv[SHARED_NAMES.index(UNMEASURED)]).astype(int)
    depth_m[v - HOLE_PX: v + HOLE_PX, u - HOLE_PX: u + HOLE_PX] = np.nan
    box_px = np.concatenate([uv.min(axis=0), uv.max(axis=0)])
    return RgbdFrame(rgb, depth_m, CAMERA), Detection(uv, np.ones(len(uv)), box_px)


def _room(floor_m: float) -> Float32[np.ndarray, 'h w']:
    """Return the depth of a wall and of a floor so far below the camera."""
    down = CAMERA.ray_grid()[..., 1]
    floor = np.where(down > 0, floor_m / np.maximum(down, 1e-9), np.inf)
    return np.minimum(floor, WALL_M).astype(np.float32)
