"""Depth images of triangle meshes: the synthetic depth D(beta, theta) of steps 6 to 8."""

from __future__ import annotations

from collections.abc import Sequence
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
    vertices_camera: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3'], camera: Camera, *,
    closed: bool = False,
) -> RenderedDepth:
    """Return the z-buffer of a mesh in the camera frame [m], seen by a pinhole.

    Lens distortion is ignored: images are undistorted before any rendering is compared with them.

    Args:
        vertices_camera: Vertices.
        f: Triangles.
        camera: The pinhole, outside of the mesh.
        closed: Whether `is_closed` holds: then the faces that look away are hidden by others, and
            half of the work is left out.
    """
    depth_m = np.zeros((camera.height, camera.width), dtype=np.float32)
    face = np.full((camera.height, camera.width), -1, dtype=np.int32)
    depth_kernels.rasterize(
        np.ascontiguousarray(vertices_camera, dtype=np.float64),
        np.ascontiguousarray(f, dtype=np.int64),
        camera.fx, camera.fy, camera.cx, camera.cy, closed, depth_m, face,
    )
    return RenderedDepth(depth_m, face)


def render_alike(
    vertices_camera: Sequence[Float[np.ndarray, 'n 3']], f: Int[np.ndarray, 'm 3'],
    camera: Camera, *, closed: bool = False,
) -> Float32[np.ndarray, 'k h w']:
    """Return the z-buffers of versions of a mesh [m]; +inf where one is not seen.

    The fewer vertices differ between them, the less each of them takes.

    Args:
        vertices_camera: Vertices of each version.
        f: Triangles of all of them.
        camera: The pinhole.
        closed: As in `render_depth`.
    """
    depth_m = np.zeros((len(vertices_camera), camera.height, camera.width), dtype=np.float32)
    if len(vertices_camera):
        depth_kernels.rasterize_alike(
            np.stack(vertices_camera), np.ascontiguousarray(f, dtype=np.int64),
            camera.fx, camera.fy, camera.cx, camera.cy, closed, depth_m)
    return depth_m


def render_parts(
    vertices_camera: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3'],
    part: Int[np.ndarray, 'm'], count: int, camera: Camera, *, closed: bool = False,
) -> Float32[np.ndarray, 'p h w']:
    """Return the z-buffer of each part of a mesh alone [m]; +inf where it is not seen.

    Args:
        vertices_camera: Vertices.
        f: Triangles.
        part: Part of each triangle, 0 to count - 1.
        count: How many parts.
        camera: The pinhole.
        closed: Whether the whole mesh is: then faces that look away are left out, and a part has
            no inside where it was cut from the others.
    """
    depth_m = np.zeros((count, camera.height, camera.width), dtype=np.float32)
    depth_kernels.rasterize_parts(
        np.ascontiguousarray(vertices_camera, dtype=np.float64),
        np.ascontiguousarray(f, dtype=np.int64), np.ascontiguousarray(part, dtype=np.int64),
        camera.fx, camera.fy, camera.cx, camera.cy, closed, depth_m)
    return depth_m


def is_closed(vertices: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3']) -> bool:
    """Return whether a mesh is a surface without border whose faces look outward."""
    edges = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]).astype(np.int64)
    there, back = (np.sort(edges[:, k] * len(vertices) + edges[:, 1 - k]) for k in (0, 1))
    a, b, c = vertices[f].transpose(1, 0, 2)
    volume = np.einsum('nc,nc->', a, np.cross(b, c))
    return bool(np.array_equal(there, back) and (np.diff(there) > 0).all() and volume > 0.0)


def vertex_normals(
    vertices: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3']
) -> Float[np.ndarray, 'n 3']:
    """Return unit normals, outward for outward faces, weighted by the area of their triangles."""
    out = np.empty((len(vertices), 3))
    depth_kernels.area_normals(
        np.ascontiguousarray(vertices, dtype=np.float64),
        np.ascontiguousarray(f, dtype=np.int64), out)
    return out
