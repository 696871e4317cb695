"""A bag through our node, as a ROS 1 bag, in rviz with the shipped configuration."""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from ruamel.yaml import YAML
from support.node import ROOT
from support.recording import record, write_frames

from pop_core.body.default_body import default_body
from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import render_depth
from pop_ros.recorded_bodies import RecordedFrame, mesh_vertices, read_bodies
from pop_ros.to_messages import PALETTE
from scripts.ros1_screen import PACKAGES, missing_programs, ros1_screen

CONFIG = ROOT / 'rviz' / 'pop_ros1.rviz'
SIZE = (1400, 900)
# No surface of a shaded blue mesh, of axes or of the grid has this hue.
MAGENTA = (255, 0, 255)
NEAR_PX = 4  # points are two pixels wide, and rviz samples pixels elsewhere than we do
AXIS_M = 0.08
MISSING = missing_programs()

pytestmark = pytest.mark.skipif(
    bool(MISSING), reason=f'no {", ".join(MISSING)} here (apt-get install {PACKAGES})')


@pytest.fixture(scope='module')
def bodies(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RecordedFrame]:
    """A ROS 1 bag of one frame that went through the node, and what is in it."""
    folder = tmp_path_factory.mktemp('bodies')
    frame = record(folder, n_frames=3, rate_hz=4.0).scenes[1].frame
    painted = replace(frame, rgb=np.full_like(frame.rgb, MAGENTA))
    bag = write_frames(folder / 'camera.mcap', [painted], '16UC1')
    done = subprocess.run(
        [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--keypoints', 'json',
         '--keypoints-dir', str(folder), '--out', str(folder / 'out'),
         '--ros1', str(folder / 'out.bag')],
        env={**os.environ, 'PYTHONPATH': str(ROOT)}, capture_output=True, text=True, timeout=240,
        check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / 'out.bag', read_bodies(folder / 'out')[frame.stamp_ns]


@pytest.fixture(scope='module')
def picture(
    bodies: tuple[Path, RecordedFrame], tmp_path_factory: pytest.TempPathFactory
) -> np.ndarray:
    """What rviz shows of the bag, without its panels."""
    folder = tmp_path_factory.mktemp('screen')
    with ros1_screen(folder, SIZE) as screen:
        screen.start('rviz', '--fullscreen', '-d', CONFIG)
        for topic in ('/pop/mesh', '/pop/joints', '/pop/cloud'):
            screen.wait_for(
                lambda topic=topic: 'rviz' in screen.ask('rostopic', 'info', topic),
                f'rviz listening to {topic}')
        # Messages sent before rviz has connected to the player are lost: it waits for that.
        screen.start('rosbag', 'play', '--quiet', '--keep-alive', '--delay=3', bodies[0])
        seen = [screen.photograph(folder / 'rviz.png')]

        def has_settled() -> bool:
            seen.append(screen.photograph(folder / 'rviz.png'))
            is_drawn = mesh_colored(seen[-1]).any() and axis_colored(seen[-1]).any()
            return bool(is_drawn and np.array_equal(*seen[-2:]))

        screen.wait_for(has_settled, 'still picture of a mesh and axes in rviz')
    kept = os.environ.get('POP_TEST_PICTURES')
    if kept:
        shutil.copy(folder / 'rviz.png', Path(kept) / 'rviz_ros1.png')
    return seen[-1]


def mesh_colored(rgb: np.ndarray) -> np.ndarray:
    """Return pixels whose colour is a shade of the first person's mesh."""
    direction = np.array(PALETTE[0]) / np.linalg.norm(PALETTE[0])
    length = np.linalg.norm(rgb.astype(float), axis=2)
    cosine = rgb @ direction / np.maximum(length, 1e-9)
    return (cosine > np.cos(np.deg2rad(4.0))) & (length > 60)


def magenta(rgb: np.ndarray) -> np.ndarray:
    low, high = rgb[..., [0, 2]].min(axis=2).astype(int), rgb[..., 1].astype(int)
    return (low > 150) & (high < 60)


def axis_colored(rgb: np.ndarray) -> np.ndarray:
    """Return pixels of pure red, green or blue, as rviz draws the axes of poses."""
    ordered = np.sort(rgb.astype(int), axis=2)
    return (ordered[..., 2] > 60) & (ordered[..., 1] < 20)


def rviz_view() -> tuple[Camera, np.ndarray, np.ndarray]:
    """Return pinhole, R_view_camera and the viewer's place of the configured orbit view."""
    content = YAML(typ='safe').load(CONFIG.read_text())
    view = content['Visualization Manager']['Views']['Current']
    width, height = SIZE
    f = height / 2 / np.tan(np.pi / 8)  # Ogre's 45 degrees from top to bottom
    camera = Camera(width, height, f, f, (width - 1) / 2, (height - 1) / 2)
    focus = np.array([view['Focal Point'][axis] for axis in 'XYZ'], dtype=float)
    yaw, pitch = view['Yaw'], view['Pitch']
    away = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch)])
    forward = -away
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R_view_camera = np.array([right, np.cross(forward, right), forward])
    return camera, R_view_camera, focus + view['Distance'] * away


def project(p_camera: np.ndarray) -> np.ndarray:
    camera, R_view_camera, place = rviz_view()
    return camera.project((p_camera - place) @ R_view_camera.T)


def silhouette(recorded: RecordedFrame) -> np.ndarray:
    f = default_body().f
    camera, R_view_camera, place = rviz_view()
    mesh = (mesh_vertices(recorded.triangles[0], f) - place) @ R_view_camera.T
    return render_depth(mesh, f, camera).covered


def grown(mask: np.ndarray, pixels: int = NEAR_PX) -> np.ndarray:
    kernel = np.ones((2 * pixels + 1, 2 * pixels + 1), np.uint8)
    return cv2.dilate(mask.astype(np.uint8), kernel) > 0


def test_rviz_draws_the_mesh_where_the_projection_says(
    bodies: tuple[Path, RecordedFrame], picture: np.ndarray
) -> None:
    expected = silhouette(bodies[1])
    assert expected.sum() > 5000
    drawn = mesh_colored(picture)
    # Inside the outline is the mesh, or what stands before it; no grey of the grid shines through.
    covered = np.ptp(picture.astype(int), axis=2) > 20
    inside = cv2.erode(expected.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert covered[inside].mean() > 0.97
    assert drawn[inside].mean() > 0.25
    assert grown(expected)[drawn].mean() > 0.99


def test_rviz_draws_the_measured_points_of_the_person(
    bodies: tuple[Path, RecordedFrame], picture: np.ndarray
) -> None:
    cloud = bodies[1].cloud
    u, v = np.rint(project(np.column_stack([cloud[axis] for axis in 'xyz']).astype(float))
                   ).astype(int).T
    expected = np.zeros(picture.shape[:2], dtype=bool)
    expected[v, u] = True
    drawn = magenta(picture)
    assert drawn.sum() > 1000
    assert grown(expected)[drawn].mean() > 0.99
    # Points behind the fitted surface are hidden by it.
    assert grown(drawn, 2)[expected].mean() > 0.5


def test_rviz_draws_the_axes_of_joints_that_stick_out_of_the_body(
    bodies: tuple[Path, RecordedFrame], picture: np.ndarray
) -> None:
    joints = bodies[1].joints[0]
    camera, _, place = rviz_view()
    drawn = axis_colored(picture)
    near = np.zeros(drawn.shape, dtype=np.uint8)
    found = 0
    for joint, uv in zip(joints, project(joints), strict=True):
        radius = round(AXIS_M * camera.fx / np.linalg.norm(joint - place)) + NEAR_PX
        around = cv2.circle(np.zeros_like(near), np.rint(uv).astype(int).tolist(), radius, 1, -1)
        found += int(drawn[around > 0].sum() >= 6)
        near |= around
    assert found >= 12  # of 24; the others lie inside the trunk and the thighs
    assert near[drawn].mean() > 0.97
