"""Default bodies before a camera, with the truth about their shared joints."""

from dataclasses import dataclass, replace

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import attached_positions
from pop_core.body.model import rest_parameters, shared_points
from pop_core.body.skinning import vertices
from pop_core.geometry.camera import Camera
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.keypoints.people import detection_of
from pop_core.rendering.depth_renderer import render_depth
from pop_core.rgbd import RgbdFrame

CAMERA = Camera(640, 480, 560.0, 560.0, 319.5, 239.5)
UPRIGHT = np.array([np.pi, 0.0, 0.0])  # body y up is camera -y, body +z is camera -z


@dataclass(frozen=True)
class Body:
    frame: RgbdFrame
    truth: np.ndarray
    detection: object
    covered: np.ndarray


def bent(**rotvecs):
    """Body pose of a standing person, arms down, with some joints turned [rad]."""
    pose = np.zeros((23, 3))
    pose[JOINT_INDEX['left_shoulder'] - 1] = [0, 0, -1.2]
    pose[JOINT_INDEX['right_shoulder'] - 1] = [0, 0, 1.2]
    for name, rotvec in rotvecs.items():
        pose[JOINT_INDEX[name] - 1] = rotvec
    return pose


SEATED = {'left_hip': [-1.4, 0, 0], 'right_hip': [-1.4, 0, 0],
          'left_knee': [1.4, 0, 0], 'right_knee': [1.4, 0, 0]}


def show(body_pose=None, yaw=0.0, z=2.6, wall_m=4.5, scale=1.0, noise_px=0.0, seed=0):
    """Render a person in front of a wall; keypoints are the truth plus pixel noise."""
    model = default_body()
    turned = to_rotvec(from_rotvec(UPRIGHT) @ from_rotvec(np.array([0.0, yaw, 0.0])))
    parameters = replace(
        rest_parameters(), global_orient=turned, scale=scale,
        body_pose=bent() if body_pose is None else body_pose, transl=np.zeros(3))
    placed = attached_positions(shared_points(model), model, parameters)
    transl = np.array([0.0, 0.0, z]) - placed[[0, 7, 3, 4]].mean(axis=0)
    parameters = replace(parameters, transl=transl)
    truth = attached_positions(shared_points(model), model, parameters)
    rendered = render_depth(vertices(model, parameters), model.f, CAMERA)
    depth_m = np.where(rendered.covered, rendered.depth_m, np.float32(wall_m))
    rng = np.random.default_rng(seed)
    uv = CAMERA.project(truth) + rng.normal(0, 1, (15, 2)) * noise_px
    rgb = np.zeros((480, 640, 3), np.uint8)
    frame = RgbdFrame(rgb, depth_m.astype(np.float32), CAMERA)
    return Body(frame, truth, detection_of(uv, np.full(15, 0.9)), rendered.covered)


def with_depth(body, depth_m):
    frame = replace(body.frame, depth_m=depth_m.astype(np.float32))
    return replace(body, frame=frame)
