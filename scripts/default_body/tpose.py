"""Turn people from Anny's rest pose (arms and elbows bent) into SMPL's T-pose, left half only."""

import numpy as np

from default_body.source import JOINT_BONES, People
from pop_core.body.joints import JOINT_INDEX, MIRROR, PARENTS

FLIP = np.diag([-1.0, 1.0, 1.0])
# Thighs stand a little apart, as in SMPL's template; shins are vertical.
THIGH_OUT_RAD = np.deg2rad(3.0)


def to_tpose(people: People, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return half vertices (p, n, 3) and the 24 joints (p, 24, 3) in T-pose, pelvis at 0 [m].

    Each person is turned by its own bone directions, so that differences of rest pose between
    phenotypes do not enter the shape space. The blending is that of the run-time skinning.
    """
    heads = np.stack([people.bone_heads[bone] for bone in JOINT_BONES], axis=1)
    heads = _symmetric(heads)
    rotations = _outer_rotations(people, heads)
    placed = _placed_joints(heads, rotations)
    vertices = np.zeros_like(people.half_vertices)
    for joint in np.flatnonzero(weights.any(0)):
        R, start, end = rotations[:, joint], heads[:, joint, None], placed[:, joint, None]
        carried = (people.half_vertices - start) @ R.transpose(0, 2, 1) + end
        vertices += weights[:, joint, None] * carried
    pelvis = placed[:, None, 0]
    on_plane = (people.half_vertices[:, :, 0] == 0).all(0)
    vertices[:, on_plane, 0] = 0.0
    return vertices - pelvis, placed - pelvis


def _symmetric(joints: np.ndarray) -> np.ndarray:
    """Put midline joints on x = 0 and right joints where the left ones mirror to."""
    out = joints.copy()
    for name, index in JOINT_INDEX.items():
        if name.startswith('left_'):
            other = JOINT_INDEX['right_' + name[5:]]
            out[:, other] = out[:, index] * (-1, 1, 1)
        elif not name.startswith('right_'):
            out[:, index, 0] = 0.0
    return out


def _outer_rotations(people: People, heads: np.ndarray) -> np.ndarray:
    """Return the outer rotation of each joint (p, 24, 3, 3) that straightens the limbs."""
    at = {name: heads[:, index] for name, index in JOINT_INDEX.items()}
    upper = at['left_elbow'] - at['left_shoulder']
    fore = at['left_wrist'] - at['left_elbow']
    hand = at['left_hand'] - at['left_wrist']
    # Elbows bend forward in T-pose: about -y on the left side. Thumbs point forward.
    bend = np.cross(upper, fore)
    index_side = people.bone_heads['finger2-1.L'] - people.bone_heads['finger5-1.L']
    along, down, forward = np.diag([1.0, -1.0, 1.0])
    thigh = np.array([np.sin(THIGH_OUT_RAD), -np.cos(THIGH_OUT_RAD), 0.0])
    turned = {
        'left_shoulder': _frame_to_frame(upper, bend, along, down),
        'left_elbow': _frame_to_frame(fore, bend, along, down),
        'left_wrist': _frame_to_frame(hand, index_side, along, forward),
        'left_hip': _swing(at['left_knee'] - at['left_hip'], thigh),
        'left_knee': _swing(at['left_ankle'] - at['left_knee'], down),
    }
    turned['left_hand'] = turned['left_wrist']
    rotations = np.broadcast_to(np.eye(3), (len(heads), 24, 3, 3)).copy()
    for name, R in turned.items():
        rotations[:, JOINT_INDEX[name]] = R
        rotations[:, MIRROR[JOINT_INDEX[name]]] = FLIP @ R @ FLIP
    return rotations


def _placed_joints(heads: np.ndarray, rotations: np.ndarray) -> np.ndarray:
    placed = heads.copy()
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            bone = heads[:, joint] - heads[:, parent]
            carried = np.einsum('prc,pc->pr', rotations[:, parent], bone)
            placed[:, joint] = placed[:, parent] + carried
    return placed


def _frame(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return orthonormal frames (..., 3, 3) whose columns start along first, then second."""
    first, second = np.broadcast_arrays(first, second)
    x = first / np.linalg.norm(first, axis=-1, keepdims=True)
    y = second - (second * x).sum(-1, keepdims=True) * x
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _frame_to_frame(
    first: np.ndarray, second: np.ndarray, to_first: np.ndarray, to_second: np.ndarray
) -> np.ndarray:
    return _frame(to_first, to_second) @ _frame(first, second).swapaxes(-1, -2)


def _swing(direction: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the smallest rotations that turn directions (p, 3) to a target direction."""
    normal = np.cross(direction, target)
    return _frame_to_frame(direction, normal, target, normal)
