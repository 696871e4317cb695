"""Pose files of exactly the published formats, made from poses of our own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from pop_core.body.joints import JOINT_NAMES, PARENTS
from pop_core.geometry.rotation import from_rotvec, to_rotvec

Z_UP = from_rotvec(np.array([np.pi / 2, 0.0, 0.0]))
# Names of our joints in the files of each style; joints that a style lacks are left out.
_MOTION_BUILDER = {
    'pelvis': 'Hips', 'spine1': 'LowerBack', 'spine2': 'Spine', 'spine3': 'Spine1',
    'neck': 'Neck', 'head': 'Head', 'hip': 'UpLeg', 'knee': 'Leg', 'ankle': 'Foot',
    'foot': 'ToeBase', 'collar': 'Shoulder', 'shoulder': 'Arm', 'elbow': 'ForeArm',
    'wrist': 'Hand',
}
_DAZ = {
    'pelvis': 'hip', 'spine1': 'abdomen', 'spine3': 'chest', 'neck': 'neck', 'head': 'head',
    'hip': 'Thigh', 'knee': 'Shin', 'ankle': 'Foot', 'collar': 'Collar', 'shoulder': 'Shldr',
    'elbow': 'ForeArm', 'wrist': 'Hand',
}
STYLES = {'motionbuilder': (_MOTION_BUILDER, str.capitalize), 'daz': (_DAZ, lambda s: s[0])}


def style_name(joint: str, style: str) -> str | None:
    """Return a joint's name in a style, None where the style has no such joint."""
    names, side_name = STYLES[style]
    side, _, base = joint.rpartition('_')
    if base not in names:
        return None
    return (side_name(side) if side else '') + names[base]


def write_bvh(
    path: Path, root: np.ndarray, body_pose: np.ndarray, rest: np.ndarray,
    style: str = 'motionbuilder',
) -> None:
    """Write poses as a BVH file (cm, degrees, ZYX channels).

    Args:
        path: File to write.
        root: Rotation vectors of the pelvis (n,3) [rad], y up.
        body_pose: Rotation vectors (n,23,3) [rad].
        rest: Joints at rest (24,3) [m].
        style: 'motionbuilder' or 'daz'.
    """
    used = [j for j, name in enumerate(JOINT_NAMES) if style_name(name, style)]
    parent = {j: _used_parent(j, used) for j in used}
    R = from_rotvec(np.concatenate([root[:, None], body_pose], axis=1))
    columns = [np.zeros((len(root), 3))]
    lines = ['HIERARCHY']

    def visit(j: int, depth: int) -> None:
        pad = '\t' * depth
        offset = 100.0 * (rest[j] - (rest[parent[j]] if parent[j] >= 0 else rest[j]))
        kind = 'ROOT' if parent[j] < 0 else 'JOINT'
        channels = 'Zrotation Yrotation Xrotation'
        if parent[j] < 0:
            channels = '6 Xposition Yposition Zposition ' + channels
        else:
            channels = '3 ' + channels
        lines.extend([
            f'{pad}{kind} {style_name(JOINT_NAMES[j], style)}', f'{pad}{{',
            f'{pad}\tOFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}',
            f'{pad}\tCHANNELS {channels}'])
        columns.append(_euler_deg(R, j, parent[j]))
        children = [k for k in used if parent[k] == j]
        for child in children:
            visit(child, depth + 1)
        if not children:
            lines.extend([
                f'{pad}\tEnd Site', f'{pad}\t{{', f'{pad}\t\tOFFSET 0.0 0.0 4.0', f'{pad}\t}}'])
        lines.append(f'{pad}}}')

    visit(0, 0)
    rows = np.concatenate(columns, axis=1)
    lines.extend(['MOTION', f'Frames: {len(rows)}', 'Frame Time: .0083333'])
    with path.open('w') as file:
        file.write('\n'.join(lines) + '\n')
        np.savetxt(file, rows, fmt='%.4f')


def write_amass(path: Path, root: np.ndarray, body_pose: np.ndarray) -> None:
    """Write poses as an AMASS npz of the SMPL-H layout (z up).

    Args:
        path: File to write.
        root: Rotation vectors of the pelvis (n,3) [rad], y up.
        body_pose: Rotation vectors (n,23,3) [rad].
    """
    n = len(root)
    poses = np.zeros((n, 156))
    poses[:, :3] = to_rotvec(Z_UP @ from_rotvec(root))
    poses[:, 3:66] = body_pose[:, :21].reshape(n, 63)
    np.savez(
        path, poses=poses, trans=np.zeros((n, 3)), betas=np.zeros(16), dmpls=np.zeros((n, 8)),
        gender=np.array('neutral'), mocap_framerate=np.array(120.0))


def write_surreal(
    folder: Path, name: str, root: np.ndarray, body_pose: np.ndarray, pixels: np.ndarray
) -> Path:
    """Write `NAME_info.mat` of a SURREAL clip and return its path.

    Args:
        folder: Folder to write to.
        name: Name of the clip.
        root: Rotation vectors of the pelvis (n,3) [rad], y up.
        body_pose: Rotation vectors (n,23,3) [rad].
        pixels: Joints (n,24,2) [px].
    """
    n = len(root)
    pose = np.concatenate([to_rotvec(Z_UP @ from_rotvec(root)), body_pose.reshape(n, 69)], axis=1)
    path = folder / f'{name}_info.mat'
    savemat(path, {
        'pose': pose.T, 'shape': np.zeros((10, n)), 'joints2D': pixels.transpose(2, 1, 0),
        'joints3D': np.zeros((3, 24, n)), 'camLoc': np.zeros((3, 1)), 'camDist': 3.0,
        'zrot': np.zeros((n, 1)), 'gender': np.ones((n, 1), dtype=np.uint8)})
    return path


def _used_parent(j: int, used: list[int]) -> int:
    parent = PARENTS[j]
    while parent >= 0 and parent not in used:
        parent = PARENTS[parent]
    return parent


def _euler_deg(R: np.ndarray, j: int, parent: int) -> np.ndarray:
    """Return ZYX angles [deg] of the turn from a joint to its parent in the file."""
    turn, above = R[:, j], PARENTS[j]
    while above != parent:
        turn, above = R[:, above] @ turn, PARENTS[above]
    return Rotation.from_matrix(turn).as_euler('ZYX', degrees=True)
