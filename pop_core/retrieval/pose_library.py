"""A library of poses and the joints that are compared with what was measured.

Joints stand in the upright frame of each pose: y up, origin at the pelvis, heading +z, on the mean
body of the library; `tilt` says how the pelvis is turned in it (zero for a straight stand).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int, UInt16

from pop_core.body.joints import N_SHARED
from pop_core.body.model import BodyModel, shared_points
from pop_core.errors import LibraryFileError
from pop_core.retrieval.library_kernels import upright_joints

ALL_VISIBLE = (1 << N_SHARED) - 1
CHUNK = 100_000  # poses whose rotations are held in double precision at a time


@dataclass(frozen=True, slots=True, eq=False)
class PoseLibrary:
    """m poses; the arrays may be memory-mapped.

    Args:
        body_pose: Rotation vectors of joints 1..23 [rad].
        tilt: Rotation vector of the pelvis in the upright frame [rad].
        columns: The 15 shared joints [m], laid out so that one coordinate of all poses is
            contiguous, as the search wants it.
        masks: Bit i is set where shared joint i was visible when the pose was recorded.
        weights: Prior belief in each pose, 1 for an ordinary one.

    Raises:
        LibraryFileError: If the arrays do not belong together or there is no pose.
    """

    body_pose: Float32[np.ndarray, 'm 23 3']
    tilt: Float32[np.ndarray, 'm 3']
    columns: Float32[np.ndarray, 's 3 n']
    masks: UInt16[np.ndarray, 'k']
    weights: Float32[np.ndarray, 'l']

    def __post_init__(self) -> None:
        m = len(self.body_pose)
        found = (len(self.tilt), self.columns.shape[2], len(self.masks), len(self.weights))
        if m == 0 or found != (m,) * 4 or self.columns.shape[0] != N_SHARED:
            raise LibraryFileError(
                f'pose library: expected {m} > 0 tilts, joints, masks and weights for as many '
                f'poses and {N_SHARED} joints, found {found} and {self.columns.shape[0]} joints'
            )

    def __len__(self) -> int:
        return len(self.body_pose)

    @property
    def joints(self) -> Float32[np.ndarray, 'm s 3']:
        """Return the 15 shared joints of every pose [m], upright frame."""
        return self.columns.transpose(2, 0, 1)

    def subset(self, index: Int[np.ndarray, 'n']) -> PoseLibrary:
        """Return a library of the poses of `index`, in that order."""
        return PoseLibrary(
            self.body_pose[index], self.tilt[index],
            np.ascontiguousarray(self.columns[:, :, index]), self.masks[index],
            self.weights[index])


def build_library(
    body_pose: Float[np.ndarray, 'm 23 3'],
    model: BodyModel,
    tilt: Float[np.ndarray, 'm 3'] | None = None,
    masks: UInt16[np.ndarray, 'm'] | None = None,
) -> PoseLibrary:
    """Return the library of poses on the mean body of a model.

    Args:
        body_pose: Rotation vectors of joints 1..23 [rad].
        model: Body whose proportions the joints take.
        tilt: Rotation vector of each pelvis in the upright frame [rad]; zero when None.
        masks: Bitset of visible joints of each pose; all visible when None.
    """
    m = len(body_pose)
    tilt = np.zeros((m, 3)) if tilt is None else tilt
    return PoseLibrary(
        body_pose=body_pose.astype(np.float32),
        tilt=tilt.astype(np.float32),
        columns=pose_columns(body_pose, tilt, model),
        masks=np.full(m, ALL_VISIBLE, dtype=np.uint16) if masks is None else masks,
        weights=np.ones(m, dtype=np.float32),
    )


def on_body(library: PoseLibrary, model: BodyModel) -> PoseLibrary:
    """Return the library with its joints on another body: poses are anybody's, joints are not.

    Hips and shoulders of body models lie centimetres apart, as much as neighbouring poses.
    """
    columns = np.empty(library.columns.shape, dtype=np.float32)
    for start in range(0, len(library), CHUNK):
        part = slice(start, start + CHUNK)
        columns[:, :, part] = pose_columns(
            np.asarray(library.body_pose[part], dtype=np.float64),
            np.asarray(library.tilt[part], dtype=np.float64), model)
    return PoseLibrary(
        library.body_pose, library.tilt, columns, library.masks, library.weights)


def pose_columns(
    body_pose: Float[np.ndarray, 'm 23 3'], tilt: Float[np.ndarray, 'm 3'], model: BodyModel
) -> Float32[np.ndarray, 's 3 m']:
    """Return the shared joints of poses [m], upright frame, mean body of the model."""
    points = shared_points(model)
    arms = points.template - model.joint_template[points.joint]
    return np.asarray(upright_joints(
        np.asarray(body_pose, dtype=np.float64), np.asarray(tilt, dtype=np.float64),
        model.joint_template, model.parents, points.joint, arms))


def visibility_mask(visible: np.ndarray) -> int:
    """Return the bitset of a boolean array of shared joints."""
    return int(np.sum(visible.astype(np.int64) << np.arange(N_SHARED)))
