"""Compile kernels and touch the library before the first real frame arrives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, rest_parameters, shared_points
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.region import RegionConfig
from pop_core.pipeline import BodyPipeline
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rgbd import RgbdFrame

CAMERA = Camera(160, 120, 130.0, 130.0, 79.5, 59.5)
WALL_M = 4.0
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
    """Fit a small synthetic person once, so that no real frame pays for compilation."""
    frame, detection = small_scene(pipeline.model)
    # Whatever the region of interest, this person must be fitted.
    config = replace(pipeline.config, region=RegionConfig(), max_range_m=2 * PLACE[2])
    BodyPipeline(
        pipeline.model, pipeline.library, OnePerson(detection), config, pipeline.fitter.prior,
    ).process(frame)


def small_scene(model: BodyModel) -> tuple[RgbdFrame, Detection]:
    """Return a frame of the body model in front of a wall, and its keypoints."""
    parameters = rest_parameters(model.n_betas).replaced(
        global_orient=FACING_CAMERA, transl=PLACE)
    rendered = render_depth(vertices(model, parameters), model.f, CAMERA)
    depth_m = np.minimum(rendered.depth_m, np.float32(WALL_M))
    rgb = np.full((CAMERA.height, CAMERA.width, 3), 128, dtype=np.uint8)
    uv = CAMERA.project(attached_positions(shared_points(model), model, parameters))
    box_px = np.concatenate([uv.min(axis=0), uv.max(axis=0)])
    return RgbdFrame(rgb, depth_m, CAMERA), Detection(uv, np.ones(len(uv)), box_px)
