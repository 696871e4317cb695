"""A second look at one person: enlarged and brought near, as the network sees people best.

Enlarging alone would make giants of far people. Their depth is shifted instead of scaled, so that
the relief of a body stays what it is: somebody at 4 m who is shown at 2 m, with twice the pixels,
is as large, as thick and as far from the wall as before. A network of near looks, which knows one
distance, is shown near people farther alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int

from pop_core.geometry.camera import Camera
from pop_core.keypoints.canonical_depth import SIDE_MULTIPLE, CanonicalView
from pop_core.keypoints.canonical_depth_kernels import read_depth

SHOWN_AT_M = 1.5  # by networks of whole images: where they see people best
MARGIN_M = 0.15  # hands, feet and the top of the head lie beyond the joints; guesses err
SIDES_PX = (96, 224)
# What stands this far before somebody brought near would be nearer than anything a network learns
# of; left out, it is a hole like any other.
BEFORE_M = 0.8
# Focal length of the grid that looks are read from, relative to the network's: nobody is enlarged
# more than a sensor resolves.
FINEST = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class NetworkView:
    """What a network is shown, and where that really lies.

    Args:
        camera: The pinhole that the network believes in.
        enlarged: How many times as long as its focal length the real one is [px].
        nearer_m: By how much everything is shown nearer than it is [m].
        nearest_m: What would be shown before this is left out [m].
    """

    camera: Camera
    enlarged: float = 1.0
    nearer_m: float = 0.0
    nearest_m: float = 0.0

    def to_camera(self, shown: Float[np.ndarray, '... 3']) -> Float[np.ndarray, '... 3']:
        """Return where points that the network speaks of lie in the camera frame [m]."""
        z = shown[..., 2:]
        real_z = z + self.nearer_m
        return np.concatenate([shown[..., :2] / z * (real_z / self.enlarged), real_z], axis=-1)

    def from_camera(self, p_camera: Float[np.ndarray, '... 3']) -> Float[np.ndarray, '... 3']:
        """Return where the network sees points of the camera frame [m]."""
        z = p_camera[..., 2:]
        shown_z = z - self.nearer_m
        xy = p_camera[..., :2] / z * (shown_z * self.enlarged)
        return np.concatenate([xy, shown_z], axis=-1)


def centred_camera(
    ray: Float[np.ndarray, '2'], width: int, height: int, focal_px: float, enlarged: float
) -> Camera:
    """Return the pinhole a network believes in that has a real ray in its middle.

    Args:
        ray: The ray's x/z and y/z.
        width: Width of the image [px].
        height: Height of the image [px].
        focal_px: The network's focal length.
        enlarged: How many times as long as that the real one is.
    """
    cx, cy = np.array([width - 1, height - 1]) / 2 - ray * (focal_px * enlarged)
    return Camera(width, height, focal_px, focal_px, float(cx), float(cy))


def border_rays(camera: Camera) -> Float[np.ndarray, '2 2']:
    """Return the least and the greatest ray (x/z, y/z) of an image."""
    last = np.array([camera.width, camera.height]) - 1
    focal, centre = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    return np.asarray((np.array([[0, 0], last]) - centre) / focal)


def close_view(
    focal_px: float, enlarged: float, joints: Float[np.ndarray, 's 3'], surface_m: float,
    fine: CanonicalView, before_m: float = BEFORE_M,
) -> NetworkView:
    """Return the view that shows a person near and in the middle, no larger than needed.

    Args:
        focal_px: The network's focal length.
        enlarged: How many times as large as that focal length has them people are shown.
        joints: Where the person's joints may be, camera frame [m].
        surface_m: Depth of the person's surface [m].
        fine: A view of the camera: beyond its borders there is nothing to show.
        before_m: What stands this far before the person is left out.
    """
    rays = joints[:, :2] / joints[:, 2:]
    margin = MARGIN_M / surface_m
    least, greatest = border_rays(fine.camera)
    low = np.maximum(rays.min(axis=0) - margin, least)
    high = np.minimum(rays.max(axis=0) + margin, greatest)
    width, height = (
        int(np.clip(SIDE_MULTIPLE * np.ceil(extent / SIDE_MULTIPLE), *SIDES_PX))
        for extent in (high - low) * focal_px * enlarged)
    camera = centred_camera((low + high) / 2, width, height, focal_px, enlarged)
    shown_at_m = surface_m / enlarged
    return NetworkView(
        camera, enlarged, surface_m - shown_at_m, max(shown_at_m - before_m, 0.0))


def close_depth(
    depth_m: Float32[np.ndarray, 'h w'], fine: CanonicalView, view: NetworkView
) -> Float32[np.ndarray, 'H W']:
    """Return what a network is shown of measured depth [m]; 0 where nothing was measured.

    Args:
        depth_m: Measured depth, NaN where missing.
        fine: A fine view of the camera, to read from.
        view: What to show.
    """
    shown = view.camera
    out = np.empty((shown.height, shown.width), dtype=np.float32)
    rows, columns = shown_pixels(fine.camera, view)
    read_depth(
        depth_m, fine.source_v, fine.source_u, rows, columns, view.nearer_m, view.nearest_m, out)
    return out


def shown_pixels(
    fine: Camera, view: NetworkView
) -> tuple[Int[np.ndarray, 'H'], Int[np.ndarray, 'W']]:
    """Return the rows and the columns of a fine image that a view shows; some may lie outside."""
    shown = view.camera
    ratio = fine.fx / (shown.fx * view.enlarged)
    rows = (np.arange(shown.height) - shown.cy) * ratio + fine.cy
    columns = (np.arange(shown.width) - shown.cx) * ratio + fine.cx
    return np.rint(rows).astype(np.int64), np.rint(columns).astype(np.int64)
