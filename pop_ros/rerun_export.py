"""Write frames and their bodies as a recording of the rerun viewer (extra `[viz]`)."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from pop_core.body.joints import JOINT_NAMES, PARENTS
from pop_core.errors import PopError
from pop_core.estimate import JointState
from pop_core.rendering.depth_renderer import vertex_normals
from pop_core.rendering.palette import INK, PAPER
from pop_core.rendering.shown_body import ShownBody, body_color
from pop_core.rgbd import RgbdFrame, point_cloud, undistort_frame, undistort_mask
from pop_ros.report3d import SceneFrame

APPLICATION = 'pop'
TIMELINE = 'stamp'
JOINT_RADIUS_M, BONE_RADIUS_M, POINT_RADIUS_M = 0.02, 0.006, 0.004


class RerunError(PopError):
    """A recording for rerun that cannot be written here."""


def write_rerun(scenes: Iterable[SceneFrame], f: np.ndarray, path: Path) -> int:
    """Write frames and bodies as an .rrd file; return the number of frames.

    Entities: `camera` with `color` and `depth`, and per person `people/K` with mesh, joints,
    bones and measured points; all in the camera's frame (x right, y down, z forward) [m].

    Args:
        scenes: Frames in order of their stamps.
        f: Triangles of the bodies' meshes.
        path: File to write.

    Raises:
        RerunError: If the rerun SDK is not installed.
    """
    rr = rerun_sdk()
    recording = rr.RecordingStream(APPLICATION)
    recording.save(str(path))
    recording.log('/', rr.ViewCoordinates.RDF, static=True)
    count = 0
    for scene in scenes:
        recording.set_time(TIMELINE, timestamp=np.datetime64(scene.frame.stamp_ns, 'ns'))
        seen = undistort_frame(scene.frame)
        _log_camera(rr, recording, seen)
        # Whoever was in the frame before is gone unless logged again.
        recording.log('people', rr.Clear(recursive=True))
        for index, body in enumerate(scene.bodies):
            name = f'people/{index if body.id is None else body.id}'
            _log_body(rr, recording, name, body, f, body_color(body, index))
            mask = undistort_mask(body.mask, scene.frame.camera)
            _log_points(rr, recording, f'{name}/points', seen, mask)
        count += 1
    recording.flush()
    return count


def rerun_sdk() -> Any:
    """Return the module of the rerun SDK.

    Raises:
        RerunError: If it is not installed.
    """
    try:
        import rerun
    except ModuleNotFoundError as error:
        if error.name != 'rerun':
            raise
        raise RerunError(
            'rerun: expected the rerun SDK, found none: pip install rerun-sdk, or install pop '
            'with its extra [viz]') from error
    return rerun


def _log_camera(rr: Any, recording: Any, frame: RgbdFrame) -> None:
    camera = frame.camera
    recording.log('camera', rr.Pinhole(
        image_from_camera=camera.K, width=camera.width, height=camera.height,
        camera_xyz=rr.ViewCoordinates.RDF, image_plane_distance=0.4))
    recording.log('camera/color', rr.Image(frame.rgb).compress(jpeg_quality=85))
    # Zero is "no measurement" to rerun.
    recording.log('camera/depth', rr.DepthImage(np.nan_to_num(frame.depth_m), meter=1.0))


def _log_body(
    rr: Any, recording: Any, name: str, body: ShownBody, f: np.ndarray,
    color: tuple[int, int, int],
) -> None:
    recording.log(f'{name}/mesh', rr.Mesh3D(
        vertex_positions=body.vertices.astype(np.float32), triangle_indices=f,
        vertex_normals=vertex_normals(body.vertices, f).astype(np.float32), albedo_factor=color))
    seen = body.joint_state == JointState.VISIBLE
    recording.log(f'{name}/joints', rr.Points3D(
        body.joints, radii=JOINT_RADIUS_M, labels=list(JOINT_NAMES), show_labels=False,
        colors=np.where(seen[:, None], PAPER, INK).astype(np.uint8)))
    bones = [body.joints[[parent, joint]] for joint, parent in enumerate(PARENTS) if parent >= 0]
    recording.log(f'{name}/bones', rr.LineStrips3D(bones, radii=BONE_RADIUS_M, colors=color))


def _log_points(
    rr: Any, recording: Any, name: str, frame: RgbdFrame, mask: np.ndarray
) -> None:
    points, uv = point_cloud(frame, mask)
    columns, rows = uv.astype(np.int64).T
    recording.log(name, rr.Points3D(
        points, colors=frame.rgb[rows, columns], radii=POINT_RADIUS_M))
