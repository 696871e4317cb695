"""Depth images of triangle meshes: the synthetic depth D(beta, theta) of steps 6 to 8."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int32

from pop_core.geometry.camera import Camera
from pop_core.rendering import depth_kernels


@dataclass(frozen=True, slots=True, eq=False)
class RenderedDepth:
    """What a camera would measure of a mesh alone.

    Args:
        depth_m: Distance along z [m]; +inf where the mesh is not seen.
        face: Index of the triangle seen; -1 where none.
    """

    depth_m: Float32[np.ndarray, 'h w']
    face: Int32[np.ndarray, 'h w']

    @property
    def covered(self) -> Bool[np.ndarray, 'h w']:
        """Return the pixels that show the mesh."""
        return self.face >= 0


def render_depth(
    vertices_camera: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3'], camera: Camera
) -> RenderedDepth:
    """Return the z-buffer of a mesh in the camera frame [m], seen by a pinhole.

    Lens distortion is ignored: images are undistorted before any rendering is compared with them.
    """
    depth_m = np.full((camera.height, camera.width), np.inf, dtype=np.float32)
    face = np.full((camera.height, camera.width), -1, dtype=np.int32)
    depth_kernels.rasterize(
        np.ascontiguousarray(vertices_camera, dtype=np.float64),
        np.ascontiguousarray(f, dtype=np.int64),
        camera.fx, camera.fy, camera.cx, camera.cy, depth_m, face,
    )
    return RenderedDepth(depth_m, face)


def vertex_normals(
    vertices: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3']
) -> Float[np.ndarray, 'n 3']:
    """Return unit normals, outward for outward faces, weighted by the area of their triangles."""
    out = np.empty((len(vertices), 3))
    depth_kernels.area_normals(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(f, dtype=np.int64), out)
    return out
