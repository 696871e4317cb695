"""A pose found in the library for a set of lifted joints."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, slots=True, eq=False)
class PoseCandidate:
    """One pose of the library and where Eq. (1) puts it.

    Args:
        body_pose: Rotation vectors of joints 1..23 relative to their parents [rad].
        joints_camera: The pose's 15 shared joints after the transform, camera frame [m].
        scale: Scale of the similarity, body to camera, times the library body's size.
        R_camera_body: Rotation of the similarity (no reflection).
        t_camera_body: Translation of the similarity [m].
        residual_m: Weighted RMS distance to the joints that were lifted or are expected [m].
        weight: Share of belief among the returned candidates, summing to one.
        index: Row in the library.
    """

    body_pose: Float[np.ndarray, '23 3']
    joints_camera: Float[np.ndarray, 's 3']
    scale: float
    R_camera_body: Float[np.ndarray, '3 3']
    t_camera_body: Float[np.ndarray, '3']
    residual_m: float
    weight: float
    index: int
