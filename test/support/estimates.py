"""Estimates as the pipeline returns them, posed at random before a camera."""

import numpy as np

from pop_core.body.kinematics import joint_rotations, joints
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.body.skinning import vertices
from pop_core.estimate import BodyEstimate
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import render_depth

CAMERA = Camera(320, 240, 262.0, 262.0, 159.5, 119.5)


def estimate(model: BodyModel, seed: int = 0, at_m: tuple[float, float, float] = (0, 0.1, 2.8),
             camera: Camera = CAMERA) -> BodyEstimate:
    """A person who faces the camera, more or less upright, with joints known better and worse."""
    rng = np.random.default_rng(seed)
    parameters = BodyParameters(
        np.array(at_m, np.float64), np.array([np.pi, 0.1, 0.0]), rng.normal(0, 0.2, (23, 3)),
        rng.normal(size=model.n_betas))
    mesh = vertices(model, parameters)
    sigma_m = rng.uniform(0.005, 0.3, 24)
    return BodyEstimate(
        parameters, mesh, joints(model, parameters), joint_rotations(model, parameters),
        rng.integers(0, 3, 24), np.eye(3) * sigma_m[:, None, None] ** 2,
        np.isfinite(render_depth(mesh, model.f, camera).depth_m), float(rng.uniform(0.5, 1)),
        {'depth': 1.5, 'silhouette': 0.25})
