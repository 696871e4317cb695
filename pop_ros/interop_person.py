"""What messages of other packages say of one person, in plain arrays of the camera frame.

Points are the 24 joints and the landmarks of face and feet, hidden ones included: like every
result of the fit they say where a limb is, and the confidence says how sure that is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.joints import JOINT_NAMES
from pop_core.body.landmarks import LANDMARK_JOINTS, LANDMARK_NAMES, landmark_vertices
from pop_core.body.model import BodyModel
from pop_core.estimate import BodyEstimate
from pop_core.geometry.camera import Camera
from pop_ros.pop_messages import joint_confidence

POINT_NAMES = (*JOINT_NAMES, *LANDMARK_NAMES)
POINT_INDEX = {name: index for index, name in enumerate(POINT_NAMES)}


@dataclass(frozen=True, slots=True, eq=False)
class Person:
    """One person as other packages see them.

    Args:
        id: Number of the person.
        body: The estimate itself.
        camera: What sees them.
        p_camera: The points of POINT_NAMES [m].
        uv: Their pixels, with the lens's distortion; NaN behind the camera.
        in_image: Whether a point's pixel lies in the image.
        confidence: Sureness 0..1 of a point's position, falling with its variance.
        box_m: Smallest and largest coordinates of the mesh [m].
        box_px: Left, top, right and bottom of the mesh in the image, hidden parts included
            [px]; None if no part of it is in the image.
    """

    id: int
    body: BodyEstimate
    camera: Camera
    p_camera: Float[np.ndarray, 'p 3']
    uv: Float[np.ndarray, 'p 2']
    in_image: Bool[np.ndarray, 'p']
    confidence: Float[np.ndarray, 'p']
    box_m: Float[np.ndarray, '2 3']
    box_px: Float[np.ndarray, '4'] | None

    def rows(self, names: Sequence[str]) -> list[int]:
        """Return the row of each named point."""
        return [POINT_INDEX[name] for name in names]


class PersonReader:
    """Reads people off estimates of one body model."""

    def __init__(self, model: BodyModel) -> None:
        """Find the landmarks of a model."""
        self._landmarks = landmark_vertices(model)

    def read(self, person_id: int, body: BodyEstimate, camera: Camera) -> Person:
        """Return one person as a camera sees them."""
        p_camera = np.vstack([body.joints, body.vertices[self._landmarks]])
        uv = camera.project(p_camera)
        sure = joint_confidence(body.joint_covariance)
        return Person(
            person_id, body, camera, p_camera, uv, _in_image(uv, camera),
            np.concatenate([sure, sure[LANDMARK_JOINTS]]),
            np.array([body.vertices.min(axis=0), body.vertices.max(axis=0)]),
            box_px(body.vertices, camera))


def box_px(points: Float[np.ndarray, 'n 3'], camera: Camera) -> Float[np.ndarray, '4'] | None:
    """Return left, top, right and bottom [px] of points [m] in the image, None if none is."""
    uv = camera.project(points)
    seen = np.isfinite(uv).all(axis=1)
    if not seen.any():
        return None
    low, high = uv[seen].min(axis=0), uv[seen].max(axis=0)
    if np.any(high < 0) or np.any(low > _last_px(camera)):
        return None
    return np.concatenate([np.maximum(low, 0), np.minimum(high, _last_px(camera))])


def _in_image(uv: Float[np.ndarray, 'p 2'], camera: Camera) -> Bool[np.ndarray, 'p']:
    # Pixel centres are integers: the image reaches half a pixel beyond the outermost. NaN is out.
    return np.asarray(np.all((uv >= -0.5) & (uv <= _last_px(camera) + 0.5), axis=1))


def _last_px(camera: Camera) -> Float[np.ndarray, '2']:
    return np.array([camera.width - 1.0, camera.height - 1.0])
