"""Pinhole camera with lens distortion: points of the camera frame [m] to pixels and back.

Pixel centres are integers. Models are those of ROS CameraInfo (REP 104): plumb_bob (Brown 1971),
rational_polynomial and equidistant (Kannala and Brandt 2006).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from jaxtyping import Float

from pop_core.errors import CameraError

FOCAL_PX = (1.0, 1e6)  # no lens is shorter or longer
# Of the sensors of 640x480 pixels that constants in pixels were chosen for.
USUAL_FOCAL_PX = 525.0
DISTORTION_LENGTHS = {
    '': (0,),
    'plumb_bob': (0, 4, 5),
    'rational_polynomial': (0, 8, 12, 14),
    'equidistant': (0, 4),
}


def _no_distortion() -> Float[np.ndarray, 'd']:
    return np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class Camera:
    """Intrinsics of one camera.

    Args:
        width: Image width [px].
        height: Image height [px].
        fx: Focal length along u [px].
        fy: Focal length along v [px].
        cx: Principal point, u [px].
        cy: Principal point, v [px].
        distortion_model: Name as in CameraInfo; '' is a pure pinhole.
        d: Distortion coefficients in the model's order.
        quarter_turns: Counterclockwise quarter turns that bring its image upright: 0 to 3.

    Raises:
        CameraError: If focal lengths are not positive or coefficients do not fit the model.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion_model: str = ''
    d: Float[np.ndarray, 'd'] = field(default_factory=_no_distortion)
    quarter_turns: int = 0

    def __post_init__(self) -> None:
        # OpenCV calibrates into a matrix of one row.
        object.__setattr__(self, 'd', np.asarray(self.d, dtype=np.float64).ravel())
        numbers = np.array([self.fx, self.fy, self.cx, self.cy])
        low, high = FOCAL_PX
        if not (np.isfinite(numbers).all() and low <= min(numbers[:2]) and max(numbers) <= high):
            raise CameraError(
                f'camera: expected finite intrinsics with fx and fy of {low} to {high} px, found '
                f'fx={self.fx} fy={self.fy} cx={self.cx} cy={self.cy}: is the camera calibrated?'
            )
        if self.width <= 0 or self.height <= 0:
            raise CameraError(
                f'camera: expected a positive size, found {self.width}x{self.height}'
            )
        allowed = DISTORTION_LENGTHS.get(self.distortion_model)
        if allowed is None:
            raise CameraError(
                f'camera: expected distortion model one of {list(DISTORTION_LENGTHS)}, found '
                f'{self.distortion_model!r}'
            )
        if self.d.size not in allowed or not np.isfinite(self.d).all():
            raise CameraError(
                f'camera: expected {" or ".join(map(str, allowed))} finite coefficients of '
                f'{self.distortion_model or "no distortion"}, found {self.d.tolist()}'
            )
        if self.quarter_turns not in range(4):
            raise CameraError(
                f'camera: expected 0 to 3 quarter turns, found {self.quarter_turns}')

    @property
    def K(self) -> Float[np.ndarray, '3 3']:  # noqa: N802 - the field's word
        """Return the 3x3 matrix of intrinsics [px]."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    @property
    def is_distorted(self) -> bool:
        """Return whether any distortion coefficient differs from zero."""
        return bool(np.any(self.d))

    @property
    def _kind(self) -> tuple[int, int, str, int]:
        return self.width, self.height, self.distortion_model, self.quarter_turns

    def sees_like(self, other: Camera, within_px: float = 0.0) -> bool:
        """Return whether two cameras see the same points at the same pixels.

        Args:
            other: The other camera.
            within_px: By how much focal lengths and principal points may differ.
        """
        return bool(
            self._kind == other._kind
            and (np.abs(self.K - other.K) <= within_px).all() and np.array_equal(self.d, other.d))

    def project(self, p_camera: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n 2']:
        """Return pixels of points in the camera frame [m]; points with z <= 0 give NaN."""
        p_camera = np.asarray(p_camera, dtype=np.float64)
        in_front = p_camera[:, 2] > 0
        safe = np.where(in_front[:, None], p_camera, [0.0, 0.0, 1.0])
        if self.is_distorted:
            uv = self._project_distorted(safe)
        else:
            uv = safe[:, :2] / safe[:, 2:] * [self.fx, self.fy] + [self.cx, self.cy]
        return np.where(in_front[:, None], uv, np.nan)

    def unproject(
        self, uv: Float[np.ndarray, 'n 2'], depth_m: Float[np.ndarray, 'n']
    ) -> Float[np.ndarray, 'n 3']:
        """Return points of the camera frame [m] of pixels with depth along z [m]."""
        uv = np.asarray(uv, dtype=np.float64)
        if self.is_distorted:
            xy = self._undistort(uv)
        else:
            xy = (uv - [self.cx, self.cy]) / [self.fx, self.fy]
        return np.column_stack([xy * depth_m[:, None], depth_m])

    def ray_grid(self) -> Float[np.ndarray, 'h w 2']:
        """Return (x/z, y/z) of every pixel: multiply by depth [m] for points."""
        if not self.is_distorted:
            x = (np.arange(self.width) - self.cx) / self.fx
            y = (np.arange(self.height) - self.cy) / self.fy
            return np.stack(np.broadcast_arrays(x, y[:, None]), axis=-1)
        v, u = np.mgrid[: self.height, : self.width]
        uv = np.column_stack([u.ravel(), v.ravel()]).astype(np.float64)
        rays = self.unproject(uv, np.ones(len(uv)))
        return rays[:, :2].reshape(self.height, self.width, 2)

    def resized(self, factor: float) -> Camera:
        """Return the camera of the image resized by `factor` (centres: u' = (u+0.5)s - 0.5)."""
        return replace(
            self, width=round(self.width * factor), height=round(self.height * factor),
            fx=self.fx * factor, fy=self.fy * factor,
            cx=(self.cx + 0.5) * factor - 0.5, cy=(self.cy + 0.5) * factor - 0.5)

    def without_distortion(self) -> Camera:
        """Return the pure pinhole of the same intrinsics."""
        return replace(self, distortion_model='', d=_no_distortion())

    def turned(self) -> Camera:
        """Return the camera whose image is this one's after a counterclockwise quarter turn.

        Its x is this one's y, its y this one's -x.

        Raises:
            CameraError: If its sensor is tilted: no coefficients say so of the turned image.
        """
        return Camera(
            self.height, self.width, self.fy, self.fx, self.cy, self.width - 1 - self.cx,
            self.distortion_model, self._turned_distortion(), max(self.quarter_turns - 1, 0))

    def _turned_distortion(self) -> Float[np.ndarray, 'd']:
        d = self.d.copy()
        if self.distortion_model == 'equidistant' or not d.size:
            return d  # the same in all directions
        d[2], d[3] = -self.d[3], self.d[2]  # decentring
        if d.size >= 12:
            d[8:10], d[10:12] = self.d[10:12], -self.d[8:10]  # thin prism
        if np.any(d[12:]):
            raise CameraError(
                'camera: expected no tilted sensor (coefficients 13 and 14) beside quarter turns, '
                f'found {self.d[12:].tolist()}')
        return d

    def _project_distorted(self, p: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n 2']:
        zero = np.zeros(3)
        if self.distortion_model == 'equidistant':
            uv, _ = cv2.fisheye.projectPoints(p[:, None], zero, zero, self.K, self.d)
        else:
            uv, _ = cv2.projectPoints(p[:, None], zero, zero, self.K, self.d)
        return uv[:, 0]

    def _undistort(self, uv: Float[np.ndarray, 'n 2']) -> Float[np.ndarray, 'n 2']:
        if len(uv) == 0:
            return uv
        if self.distortion_model == 'equidistant':
            return cv2.fisheye.undistortPoints(uv[:, None], self.K, self.d)[:, 0]
        # The default 5 iterations leave 0.1 px at the corners of wide lenses.
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-8)
        # OpenCV 5 gave undistortPoints the criteria of OpenCV 4's undistortPointsIter.
        undistort = getattr(cv2, 'undistortPointsIter', cv2.undistortPoints)
        rays = undistort(uv[:, None], self.K, self.d, R=None, P=None, criteria=criteria)
        return np.asarray(rays)[:, 0]
