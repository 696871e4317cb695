"""Large flat surfaces of a depth image, whichever way they face: walls, tables, seats, beds.

People are not flat, and where they rest on such a surface nothing but its flatness tells the two
apart: there is no step of depth between a sitter and a seat.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int32

from pop_core.depth_noise import DepthNoise
from pop_core.geometry.camera import Camera
from pop_core.segmentation.ground import grid_stride, points_and_normals

TRIES = 60  # points that propose a plane with their own normal
MOST = 8
FEWEST = 6  # points of the thinned cloud that a plane is fitted to
LEAST_M2 = 0.12  # a chest, or a thigh, has less that is flat
WIDTH_M, WIDTH_SIGMAS = 0.015, 1.0  # of a plane while it is looked for
ALIKE_COS = 0.9
MARGIN_M, MARGIN_SIGMAS = 0.02, 1.5  # of a plane's pixels
STEEPEST = 0.1  # slant beyond which areas are noise


def find_planes(
    depth_m: Float32[np.ndarray, 'h w'], camera: Camera, noise: DepthNoise
) -> Float[np.ndarray, 'p 4']:
    """Return the planes that much of an image lies on, largest first: unit normal and offset [m].

    Each proposal is one measured point with its own normal. The one with the largest area is
    settled by least squares, its points are set aside, and so on (sequential RANSAC, but with
    proposals spread evenly over the image instead of drawn).

    Args:
        depth_m: Measured depth [m], NaN where there is none.
        camera: Pinhole of the image.
        noise: Noise of its depth.
    """
    points, normals = points_and_normals(depth_m, camera)
    side = points[:, 2] * grid_stride(depth_m.shape)
    area_m2 = (side / camera.fx) * (side / camera.fy)
    width = WIDTH_M + WIDTH_SIGMAS * noise.sigma_m(points[:, 2])
    proposals = np.arange(0, len(points), max(1, len(points) // TRIES))
    offset = -np.einsum('pc,pc->p', normals[proposals], points[proposals])
    on = np.abs(normals[proposals] @ points.T + offset[:, None]) < width
    on &= normals[proposals] @ normals.T > ALIKE_COS
    planes: list[Float[np.ndarray, '4']] = []
    left: Bool[np.ndarray, 'n'] = np.ones(len(points), dtype=bool)
    while len(planes) < MOST and len(proposals):
        support = on @ (area_m2 * left)
        best = int(np.argmax(support))
        if support[best] < LEAST_M2:
            break
        on_plane = on[best] & left
        on[best] = False
        if np.count_nonzero(on_plane) < FEWEST:
            continue
        plane = _settled(points[on_plane], width[on_plane])
        near = np.abs(points @ plane[:3] + plane[3]) < 1.5 * width
        left &= ~(near | on_plane)
        planes.append(plane)
    return np.array(planes).reshape(-1, 4)


def _settled(
    points: Float[np.ndarray, 'n 3'], width: Float[np.ndarray, 'n']
) -> Float[np.ndarray, '4']:
    """Return the least squares plane of points, noisy ones counting less."""
    weight = 1.0 / width**2
    centre = weight @ points / weight.sum()
    spread = np.sqrt(weight)[:, None] * (points - centre)
    normal = np.linalg.eigh(spread.T @ spread)[1][:, 0]
    return np.append(normal, -normal @ centre)


def pieces_of_plane(
    plane: Float[np.ndarray, '4'], depth_m: Float32[np.ndarray, 'h w'],
    rays: Float[np.ndarray, 'h w 2'], camera: Camera, noise: DepthNoise,
) -> tuple[Int32[np.ndarray, 'h w'], Float[np.ndarray, 'k']]:
    """Return the pixels on a plane, numbered piece by piece from 1, and each piece's area [m^2].

    Args:
        plane: Unit normal and offset [m].
        depth_m: Measured depth [m], NaN where there is none.
        rays: (x/z, y/z) of every pixel.
        camera: Pinhole of the image.
        noise: Noise of the depth.

    Returns:
        Numbers of pixels, 0 off the plane, and areas by number; that of 0 is zero.
    """
    z = np.nan_to_num(depth_m)
    slope = rays @ plane[:2] + plane[2]
    margin_m = MARGIN_M + MARGIN_SIGMAS * noise.sigma_m(z)
    on = (np.abs(slope * z + plane[3]) < margin_m) & (z > 0)
    count, number = cv2.connectedComponents(on.astype(np.uint8), connectivity=4)
    seen_m2 = (z[on] / camera.fx) * (z[on] / camera.fy)
    # A surface seen at a slant is larger than it looks.
    area_m2 = seen_m2 / np.maximum(np.abs(slope[on]), STEEPEST)
    return number, np.bincount(number[on], weights=area_m2, minlength=count)
