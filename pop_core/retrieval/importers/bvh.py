"""BVH motion on the body's tree: CMU's MotionBuilder and Daz conversions and the like (y up).

A limb is carried over by where its bone points: with G_a the turn of a bone from its rest in the
file, the body's bone turns by G_a A, where A takes the body's rest direction to the file's. Rest
poses may thus differ (arms out, arms down, legs astride).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float

from pop_core.body.joints import JOINT_INDEX, JOINT_NAMES, PARENTS
from pop_core.body.model import BodyModel
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.canonical_pose import canonical_pose
from pop_core.retrieval.importers.bvh_file import BvhMotion, read_bvh_motion
from pop_core.retrieval.importers.clip import PoseClip, make_clip

# Our joint, and its names in files (lower case, first match wins), left limbs only.
_TRUNK = {
    'pelvis': ('hips', 'hip', 'pelvis', 'root'),
    'spine3': ('spine3', 'spine2', 'spine1', 'chest2', 'chest', 'spine', 'thorax'),
    'neck': ('neck', 'neck1'),
    'head': ('head',),
}
# One row per naming style: collar, shoulder, elbow, wrist, hip, knee, ankle.
_LIMB_JOINTS = ('collar', 'shoulder', 'elbow', 'wrist', 'hip', 'knee', 'ankle')
_LIMB_STYLES = (
    ('{side}shoulder', '{side}arm', '{side}forearm', '{side}hand', '{side}upleg', '{side}leg',
     '{side}foot'),
    ('{s}collar', '{s}shldr', '{s}forearm', '{s}hand', '{s}thigh', '{s}shin', '{s}foot'),
    ('{side}collar', '{side}shoulder', '{side}elbow', '{side}wrist', '{side}hip', '{side}knee',
     '{side}ankle'),
)
# Joints whose bone is compared, and the joint at its other end.
_BONES = {
    'shoulder': 'elbow', 'elbow': 'wrist', 'wrist': 'wrist', 'hip': 'knee', 'knee': 'ankle',
}


def read_bvh(path: Path, model: BodyModel, every: int = 1) -> PoseClip:
    """Return every n-th pose of a BVH file.

    Args:
        path: BVH file with y up.
        model: Body whose rest pose the rotations are for.
        every: Step between frames.

    Raises:
        LibraryFileError: If the file is damaged or its joints are named like no known skeleton.
    """
    motion = read_bvh_motion(path, every)
    places = match_joints(motion.names)
    R = world_rotations(motion)
    facing = _facing(motion, places)
    global_rotations = _carried_over(motion, places, facing.T @ R @ facing, facing, model)
    local = _relative_to_parents(global_rotations)
    rotvec = to_rotvec(local)
    pose = canonical_pose(rotvec[:, 1:])
    return make_clip(rotvec[:, 0], pose, 'y')


def match_joints(names: tuple[str, ...]) -> dict[str, int]:
    """Return the file's joint of each of our joints that it has.

    Raises:
        LibraryFileError: If no naming style fits.
    """
    index = {name.lower().split(':')[-1].replace('_', ''): i for i, name in enumerate(names)}
    found = {
        ours: next(index[name] for name in candidates if name in index)
        for ours, candidates in _TRUNK.items() if any(name in index for name in candidates)
    }
    for style in _LIMB_STYLES:
        limbs = {
            f'{side}_{joint}': index.get(name.format(side=side, s=side[0]), -1)
            for side in ('left', 'right')
            for joint, name in zip(_LIMB_JOINTS, style, strict=True)
        }
        if min(limbs.values()) >= 0 and len(found) == len(_TRUNK):
            return {**found, **limbs}
    raise LibraryFileError(
        'expected joints named as MotionBuilder (LeftUpLeg), Daz (lThigh) or by their joints '
        f'(LeftKnee), found {list(names[:12])} ...')


def world_rotations(motion: BvhMotion) -> Float[np.ndarray, 'n j 3 3']:
    """Return each joint's rotation relative to the file's world."""
    R = np.empty_like(motion.rotations)
    for j, parent in enumerate(motion.parents):
        local = motion.rotations[:, j]
        R[:, j] = local if parent < 0 else R[:, parent] @ local
    return R


def _rest_places(motion: BvhMotion) -> Float[np.ndarray, 'j 3']:
    rest = np.zeros_like(motion.offsets)
    for j, parent in enumerate(motion.parents):
        rest[j] = motion.offsets[j] + (rest[parent] if parent >= 0 else 0.0)
    return rest


def _facing(motion: BvhMotion, places: dict[str, int]) -> Float[np.ndarray, '3 3']:
    """Return the turn about y from our rest (facing +z) to the file's."""
    rest = _rest_places(motion)
    left = rest[places['left_hip']] - rest[places['right_hip']]
    return from_rotvec(np.array([0.0, np.arctan2(-left[2], left[0]), 0.0]))


def _carried_over(
    motion: BvhMotion,
    places: dict[str, int],
    R: Float[np.ndarray, 'n j 3 3'],
    facing: Float[np.ndarray, '3 3'],
    model: BodyModel,
) -> Float[np.ndarray, 'n 24 3 3']:
    """Return the body's global rotations, joints the file lacks following their parents."""
    rest = _rest_places(motion) @ facing  # row vectors: facing^T applied to each
    out = np.empty((len(R), len(JOINT_NAMES), 3, 3))
    for j, name in enumerate(JOINT_NAMES):
        if name not in places:
            out[:, j] = out[:, PARENTS[j]]
            continue
        side, _, joint = name.rpartition('_')
        align = np.eye(3)
        if joint in _BONES:
            end = f'{side}_{_BONES[joint]}'
            start = name if joint != 'wrist' else f'{side}_elbow'
            ours = model.joint_template[JOINT_INDEX[end]] - model.joint_template[
                JOINT_INDEX[start]]
            align = _shortest_turn(ours, rest[places[end]] - rest[places[start]])
        out[:, j] = R[:, places[name]] @ align
    return out


def _relative_to_parents(
    R: Float[np.ndarray, 'n 24 3 3'],
) -> Float[np.ndarray, 'n 24 3 3']:
    local = R.copy()
    for j, parent in enumerate(PARENTS):
        if parent >= 0:
            local[:, j] = R[:, parent].transpose(0, 2, 1) @ R[:, j]
    return local


def _shortest_turn(
    start: Float[np.ndarray, '3'], end: Float[np.ndarray, '3']
) -> Float[np.ndarray, '3 3']:
    """Return the smallest rotation that takes one direction to another."""
    a, b = start / np.linalg.norm(start), end / max(float(np.linalg.norm(end)), 1e-9)
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return np.eye(3)
    return from_rotvec(axis / sine * np.arctan2(sine, float(a @ b)))
