"""A run of poses read from one file, checked and turned into the library's frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, UInt16

from pop_core.body.joint_limits import mirrored_pose
from pop_core.body.joints import N_SHARED, SHARED_MIRROR
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.pose_library import ALL_VISIBLE

LARGEST_RAD = 4.0 * np.pi  # rotation vectors may wind, but numbers beyond are not angles
FLAT = 0.3  # horizontal part of the facing direction below which a person lies


@dataclass(frozen=True, slots=True, eq=False)
class PoseClip:
    """Poses of one file.

    Args:
        body_pose: Rotation vectors of joints 1..23 [rad].
        tilt: Rotation vector of the pelvis in the upright frame [rad].
        masks: Bitset of visible shared joints.
    """

    body_pose: Float32[np.ndarray, 'n 23 3']
    tilt: Float32[np.ndarray, 'n 3']
    masks: UInt16[np.ndarray, 'n']

    def __len__(self) -> int:
        return len(self.tilt)

    def every(self, step: int) -> PoseClip:
        """Return every step-th pose."""
        return PoseClip(self.body_pose[::step], self.tilt[::step], self.masks[::step])

    def with_mirror(self) -> PoseClip:
        """Return each pose followed, at the end, by all mirror images."""
        bits = self.masks[:, None] >> np.arange(N_SHARED, dtype=np.uint16) & 1
        swapped = bits[:, SHARED_MIRROR].astype(np.int64) << np.arange(N_SHARED)
        signs = np.array([1, -1, -1], dtype=np.float32)
        return PoseClip(
            np.concatenate([self.body_pose, mirrored_pose(self.body_pose)]),
            np.concatenate([self.tilt, self.tilt * signs]),
            np.concatenate([self.masks, swapped.sum(axis=1).astype(np.uint16)]))


def make_clip(
    root: Float[np.ndarray, 'n 3'],
    body_pose: Float[np.ndarray, 'n 23 3'],
    up: str,
    masks: UInt16[np.ndarray, 'n'] | None = None,
) -> PoseClip:
    """Return a clip of SMPL rotations.

    Args:
        root: Rotation vector of the pelvis in the file's world [rad].
        body_pose: Rotation vectors of joints 1..23 [rad].
        up: Axis of the file's world that points up, 'y' or 'z'.
        masks: Bitset of visible shared joints; all visible when None.

    Raises:
        LibraryFileError: If there is no pose, or a number is not an angle.
    """
    if len(root) == 0:
        raise LibraryFileError('expected at least one pose, found none')
    for name, values in (('root', root), ('pose', body_pose)):
        with np.errstate(invalid='ignore'):
            good = (np.abs(values) < LARGEST_RAD).reshape(len(values), -1).all(axis=1)
        if not good.all():
            frame = int(np.argmin(good))
            raise LibraryFileError(
                f'frame {frame}: expected finite {name} rotations below {LARGEST_RAD:.1f} rad, '
                f'found {values[frame].reshape(-1)[:3].tolist()} ...')
    if masks is None:
        masks = np.full(len(root), ALL_VISIBLE, dtype=np.uint16)
    tilt = upright_tilt(np.asarray(root, dtype=np.float64), up)
    return PoseClip(body_pose.astype(np.float32), tilt.astype(np.float32), masks)


def upright_tilt(root: Float[np.ndarray, 'n 3'], up: str) -> Float[np.ndarray, 'n 3']:
    """Return the pelvis' rotation [rad] after its heading is turned to +z of a y-up frame.

    The heading is where the body faces; for people who lie, where their feet point.
    """
    R = from_rotvec(root)
    if up == 'z':
        R = from_rotvec(np.array([-0.5 * np.pi, 0.0, 0.0])) @ R
    facing, feet = R[:, :, 2], -R[:, :, 1]
    lies = np.hypot(facing[:, 0], facing[:, 2]) < FLAT
    heading = np.where(lies[:, None], feet, facing)
    yaw = np.arctan2(heading[:, 0], heading[:, 2])
    turn = np.zeros((len(R), 3))
    turn[:, 1] = -yaw
    return to_rotvec(from_rotvec(turn) @ R)
