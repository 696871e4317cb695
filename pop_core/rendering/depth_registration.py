"""Depth of one camera as another camera at a known place would have measured it.

The depth image is drawn as a surface into the colour camera's z-buffer, so that nearer things hide
farther ones and a finer colour image gets no holes. Across jumps of depth there is no surface.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from pop_core.errors import FrameError
from pop_core.geometry.camera import Camera
from pop_core.rendering import registration_kernels

JUMP_RATIO = 0.03  # neighbours farther apart than this share of their depth are two surfaces


class DepthRegistration:
    """A pair of cameras whose depth is registered frame after frame."""

    def __init__(
        self, depth_camera: Camera, color_camera: Camera, T_color_depth: Float[np.ndarray, '4 4']
    ) -> None:
        """Prepare the rays of the depth camera.

        Args:
            depth_camera: Camera that measured depth.
            color_camera: Camera that depth is wanted for.
            T_color_depth: Colour camera from depth camera [m].
        """
        self.depth_camera, self.color_camera = depth_camera, color_camera
        self.T_color_depth = T_color_depth
        self._offset = np.ascontiguousarray(T_color_depth[:3, 3])
        grid = depth_camera.ray_grid()
        rays = np.concatenate([grid, np.ones_like(grid[..., :1])], axis=-1)
        # Turned once, rays need no rotation per frame.
        self._rays_color = np.ascontiguousarray(rays @ T_color_depth[:3, :3].T)
        self._places = _distorted_places(color_camera)

    def apply(self, depth_m: Float32[np.ndarray, 'h w']) -> Float32[np.ndarray, 'H W']:
        """Return depth [m] in the colour camera's pixels, NaN where nothing was measured.

        Raises:
            FrameError: If the depth image has not the size of the depth camera.
        """
        camera = self.depth_camera
        if depth_m.shape != (camera.height, camera.width):
            raise FrameError(
                f'depth: expected {camera.width}x{camera.height} as its camera says, found '
                f'{depth_m.shape[1]}x{depth_m.shape[0]}')
        target = self.color_camera
        drawn = np.zeros((target.height, target.width), dtype=np.float32)
        registration_kernels.draw_measured_surface(
            np.ascontiguousarray(depth_m), self._rays_color, self._offset, JUMP_RATIO,
            target.fx, target.fy, target.cx, target.cy, drawn,
            np.empty(drawn.shape, dtype=np.int32))
        registered = np.where(np.isfinite(drawn), drawn, np.float32(np.nan))
        if self._places is None:
            return registered
        u, v, inside = self._places
        return np.where(inside, registered[v, u], np.float32(np.nan))


def _distorted_places(
    camera: Camera
) -> tuple[Int[np.ndarray, 'h w'], Int[np.ndarray, 'h w'], Bool[np.ndarray, 'h w']] | None:
    """Return where the pinhole image shows what each pixel of a distorted camera shows."""
    if not camera.is_distorted:
        return None
    rays = camera.ray_grid()
    u = np.rint(rays[..., 0] * camera.fx + camera.cx).astype(np.int64)
    v = np.rint(rays[..., 1] * camera.fy + camera.cy).astype(np.int64)
    inside = (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)
    return np.where(inside, u, 0), np.where(inside, v, 0), inside
