"""The floor of a scene: the horizontal plane that nothing lies below."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.plane_kernels import plane_shares

GRID_PX = 80  # longest side of the thinned image: a floor is large
TILT_COS = 0.6  # cameras look down or up by at most 53 degrees
ROLL_SIN = 0.35
INLIER_M = 0.03
FLOOR_M = 0.02  # shoes begin above this
ALIKE_COS = 0.85
NARROWINGS = (1.0, 0.6, 0.4)  # of the inlier band, refinement by refinement
MIN_SHARE = 0.02  # of all measured points
MAX_BELOW = 0.005  # share of points that may lie below a floor: mirrors, noise
SURELY_BELOW = 1.5  # standard deviations; of people on their floor none is below by a whole one
BELOW_WIDTHS = 3.0  # surely below: this many widths of the plane
LOOSE_BELOW = 0.02  # the same for a proposal, whose normal is one noisy pixel's


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """A floor plane: `normal . p + offset_m` is the height of a point above it [m].

    Args:
        normal: Unit normal pointing up, camera frame.
        offset_m: Height of the camera above the floor [m].
    """

    normal: Float[np.ndarray, '3']
    offset_m: float

    def height(self, p_camera: Float[np.ndarray, 'n 3']) -> Float[np.ndarray, 'n']:
        """Return heights above the floor [m]."""
        return p_camera @ self.normal + self.offset_m

    def floor_pixels(
        self, depth_m: Float32[np.ndarray, 'h w'], camera: Camera
    ) -> Bool[np.ndarray, 'h w']:
        """Return the pixels that show the floor itself.

        Args:
            depth_m: Measured depth [m]; NaN is no floor.
            camera: The pinhole of the image.
        """
        across = self.normal[0] * (np.arange(camera.width) - camera.cx) / camera.fx
        down = self.normal[1] * (np.arange(camera.height) - camera.cy) / camera.fy
        along_ray = (down + self.normal[2]).astype(np.float32)[:, None] + across.astype(np.float32)
        with np.errstate(invalid='ignore', over='ignore'):
            # height - width of the floor, in the order that needs the fewest passes
            above = (along_ray - np.float32(0.002) * depth_m) * depth_m
            return np.asarray(above < np.float32(FLOOR_M - self.offset_m))


def find_ground(frame: RgbdFrame, tries: int = 60) -> Ground | None:
    """Return the floor, or None when no large upward plane has nothing below it.

    Every candidate plane is one measured point with its own normal. The one with the most points
    on it is refined by least squares and must then have almost nothing below it: seats and tables
    fail because a floor or the foot of a wall lies below them, and the next candidate is tried.

    Args:
        frame: An undistorted frame.
        tries: How many points, evenly over the upward ones, propose a plane.
    """
    points, normals = points_and_normals(frame.depth_m, frame.camera)
    turns = frame.camera.quarter_turns
    upward = np.flatnonzero(_upward(normals, turns))
    if len(upward) < MIN_SHARE * len(points) or len(points) < 50:
        return None
    proposals = upward[:: max(1, len(upward) // tries)]
    normal, on_plane = normals[proposals], points[proposals]
    # Depth noise grows with distance, and so does the width of a plane.
    width = INLIER_M + 0.004 * points[:, 2] ** 2
    support, below = np.zeros((2, len(proposals)))
    plane_shares(
        np.ascontiguousarray(points.T), width, normal, on_plane, BELOW_WIDTHS, support, below)
    support[below > LOOSE_BELOW] = 0.0
    while support.max() >= MIN_SHARE:
        best = int(np.argmax(support))
        ground = _settled(normal[best], on_plane[best], points, normals, width)
        share_below = np.mean(ground.height(points) < -width)
        if share_below <= MAX_BELOW and _upward(ground.normal, turns):
            return ground
        # A seat or a table with floor beside it: none of its points proposes a better plane.
        support[np.abs(ground.height(on_plane)) < width[proposals]] = 0.0
        support[best] = 0.0
    return None


def ground_of(
    ground: Ground | None, p_camera: Float[np.ndarray, 'n 3'], sigma_m: Float[np.ndarray, 'n']
) -> Ground | None:
    """Return the floor as somebody's who is not below it, else None.

    Where a sofa or a table hides all that lies below it, its top looks like a floor.

    Args:
        ground: What was found, or None.
        p_camera: Where the person's joints are expected [m].
        sigma_m: Their standard deviations [m].
    """
    if ground is None or (ground.height(p_camera) < -SURELY_BELOW * sigma_m).any():
        return None
    return ground


def _upward(
    normal: Float[np.ndarray, '*n 3'], quarter_turns: int
) -> Bool[np.ndarray, '*n']:
    """Return whether normals may be a floor's: cameras pitch more than they roll."""
    x, y = normal[..., 0], normal[..., 1]
    for _ in range(quarter_turns):
        x, y = y, -x  # as the image turned upright has them
    # Camera y points down, so a floor's normal has negative y.
    return np.asarray((y < -TILT_COS) & (np.abs(x) < ROLL_SIN))


def _settled(
    normal: Float[np.ndarray, '3'],
    on_plane: Float[np.ndarray, '3'],
    points: Float[np.ndarray, 'n 3'],
    normals: Float[np.ndarray, 'n 3'],
    width: Float[np.ndarray, 'n'],
) -> Ground:
    """Return a proposal after it settled on the points near it that face its way."""
    ground = Ground(normal, float(-normal @ on_plane))
    for narrowing in NARROWINGS:
        # Points of a wall's foot lie near the floor too, but face another way.
        alike = normals @ ground.normal > ALIKE_COS
        ground = _refine(ground, points[alike], narrowing * width[alike])
    return ground


def _refine(
    ground: Ground, points: Float[np.ndarray, 'n 3'], width: Float[np.ndarray, 'n']
) -> Ground:
    """Return the least squares plane of the points on a plane, far ones counting less."""
    weight = (np.abs(ground.height(points)) < width) / width**2
    if np.count_nonzero(weight) < 3:
        return ground  # one noisy normal proposed it, and nothing agrees
    centre = weight @ points / weight.sum()
    spread = np.sqrt(weight)[:, None] * (points - centre)
    normal = np.linalg.eigh(spread.T @ spread)[1][:, 0]
    normal = normal * np.sign(normal @ ground.normal)
    return Ground(normal, float(-normal @ centre))


def grid_stride(shape: tuple[int, ...]) -> int:
    """Return every how many-th pixel of an image is taken into the thinned cloud."""
    return max(1, max(shape) // GRID_PX)


def points_and_normals(
    depth_m: Float32[np.ndarray, 'h w'], camera: Camera
) -> tuple[Float[np.ndarray, 'n 3'], Float[np.ndarray, 'n 3']]:
    """Return a thinned cloud [m] and its unit normals toward the camera."""
    stride = grid_stride(depth_m.shape)
    # A median: single pixels are noisy.
    smooth = cv2.medianBlur(np.nan_to_num(depth_m[::stride, ::stride]), 3)
    v, u = np.mgrid[0: depth_m.shape[0]: stride, 0: depth_m.shape[1]: stride]
    z = smooth.astype(np.float64)
    p = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z], axis=-1)
    across, down = p[1:-1, 2:] - p[1:-1, :-2], p[2:, 1:-1] - p[:-2, 1:-1]
    n = np.cross(down, across)
    length = np.linalg.norm(n, axis=-1)
    valid = _whole_patches(z > 0) & (length > 0)
    normals = n[valid] / length[valid][:, None]
    points = p[1:-1, 1:-1][valid]
    toward = np.sign(-np.einsum('nc,nc->n', normals, points))
    return points, normals * toward[:, None]


def _whole_patches(measured: Bool[np.ndarray, 'h w']) -> Bool[np.ndarray, 'h2 w2']:
    """Return inner pixels whose four neighbours and themselves are measured."""
    return (
        measured[1:-1, 1:-1] & measured[1:-1, 2:] & measured[1:-1, :-2]
        & measured[2:, 1:-1] & measured[:-2, 1:-1])
