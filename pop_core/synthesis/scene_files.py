"""Scenes as folders of files: color.png, depth.png, camera.json, keypoints.json, truth.npz."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32, UInt16

from pop_core.geometry.camera import Camera
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.synthesis.scenes import SyntheticScene


def save_scene(scene: SyntheticScene, folder: Path) -> None:
    """Write one scene; depth is rounded to whole millimetres, 0 where nothing was measured."""
    folder.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(folder / 'color.png'), scene.frame.rgb[..., ::-1])
    cv2.imwrite(str(folder / 'depth.png'), depth_mm(scene.frame.depth_m))
    camera = json.dumps(camera_dict(scene.frame.camera), indent=1)
    (folder / 'camera.json').write_text(camera + '\n', encoding='utf-8')
    found = [detection for detection in scene.detections() if detection is not None]
    write_openpose_json(folder / 'keypoints.json', found)
    save_truth(scene, folder / 'truth.npz')


def save_truth(scene: SyntheticScene, path: Path) -> None:
    """Write what is known: per person parameters, joints, states, meshes and masks (stacked)."""
    people = scene.people
    stacked = {
        'joints': [p.joints for p in people],
        'shared_points': [p.shared_points for p in people],
        'vertices': [p.vertices.astype(np.float32) for p in people],
        'clothed_vertices': [p.clothed_vertices.astype(np.float32) for p in people],
        'joint_state': [p.joint_state for p in people],
        'shared_state': [p.shared_state for p in people],
        'mask': [p.mask for p in people],
        'amodal_box_px': [p.amodal_box_px for p in people],
        'transl': [p.parameters.transl for p in people],
        'global_orient': [p.parameters.global_orient for p in people],
        'body_pose': [p.parameters.body_pose for p in people],
        'betas': [p.parameters.betas for p in people],
        'scale': [p.parameters.scale for p in people],
        'pose_kind': [p.kind for p in people],
    }
    np.savez_compressed(
        path, part_labels=scene.part_labels, sensor=scene.sensor, seed=scene.seed,
        stamp_ns=scene.frame.stamp_ns, T_camera_room=scene.T_camera_room,
        **{name: np.array(values) for name, values in stacked.items()},  # type: ignore[arg-type]
    )


def depth_mm(depth_m: Float32[np.ndarray, 'h w']) -> UInt16[np.ndarray, 'h w']:
    """Return depth as REP 118 stores it in 16 bits: whole millimetres, 0 for no measurement."""
    millimetres = np.nan_to_num(depth_m * 1000.0, nan=0.0, posinf=0.0)
    return np.clip(np.rint(millimetres), 0, 65535).astype(np.uint16)


def camera_dict(camera: Camera) -> dict[str, float | int]:
    """Return the content of camera.json for a camera without distortion."""
    return {
        'width': camera.width, 'height': camera.height, 'fx': float(camera.fx),
        'fy': float(camera.fy), 'cx': float(camera.cx), 'cy': float(camera.cy),
    }
