"""One person before a wall, as the tests of the fit see them."""

import numpy as np

from pop_core.body.kinematics import attached_positions
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.keypoints.lifted_joints import LiftedJoints, LiftState
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rgbd import RgbdFrame

CAMERA = Camera(320, 240, 262.0, 262.0, 159.5, 119.5)
WALL_M = 4.0


def facing_person(betas: np.ndarray) -> BodyParameters:
    """A person facing the camera with lowered, slightly bent arms."""
    pose = np.zeros((23, 3))
    pose[15, 2], pose[16, 2] = -1.1, 1.1
    pose[17, 1], pose[18, 1] = -0.5, 0.5
    return BodyParameters(np.array([0.1, 0.1, 2.5]), np.array([np.pi, 0, 0]), pose, betas)


def photograph(body: BodyModel, *people: BodyParameters) -> RgbdFrame:
    """Somebody before a wall, without noise."""
    depths = [render_depth(vertices(body, p), body.f, CAMERA).depth_m for p in people]
    wall = np.full((CAMERA.height, CAMERA.width), WALL_M, dtype=np.float32)
    rgb = np.zeros((CAMERA.height, CAMERA.width, 3), dtype=np.uint8)
    return RgbdFrame(rgb, np.minimum.reduce([wall, *depths]), CAMERA)


def lift_truth(
    body: BodyModel, person: BodyParameters, hidden: tuple[int, ...] = (), sigma_m: float = 0.03
) -> LiftedJoints:
    """True joints with noise; hidden ones are missing."""
    rng = np.random.default_rng(0)
    p = attached_positions(shared_points(body), body, person)
    p = p + 0.5 * sigma_m * rng.normal(size=p.shape)
    state = np.zeros(15, dtype=np.int64)
    state[list(hidden)] = LiftState.MISSING
    gone = state != LiftState.VISIBLE
    return LiftedJoints(
        np.where(gone[:, None], np.nan, p), np.where(gone, np.inf, sigma_m), state,
        np.where(gone[:, None], np.nan, CAMERA.project(p)), np.where(gone, 0.0, 0.9))
