"""Shaded pictures of meshes: light from the camera, smooth normals, no textures."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Float32, Int, UInt8

from pop_core.geometry.camera import Camera
from pop_core.rendering.depth_renderer import RenderedDepth, render_depth, vertex_normals

AMBIENT = 0.32
LIGHT = np.array([-0.35, -0.55, -0.76])  # over the camera's left shoulder


def shade(
    vertices_camera: Float[np.ndarray, 'n 3'],
    f: Int[np.ndarray, 'm 3'],
    camera: Camera,
    color: tuple[int, int, int],
) -> tuple[RenderedDepth, UInt8[np.ndarray, 'h w 3']]:
    """Return the depth of a mesh and its picture, black where there is no mesh.

    Args:
        vertices_camera: Mesh [m], camera frame.
        f: Triangles.
        camera: Pinhole.
        color: RGB of the surface.
    """
    rendered = render_depth(vertices_camera, f, camera)
    brightness = AMBIENT + (1 - AMBIENT) * _facing(vertices_camera, f, camera, rendered)
    picture = np.clip(brightness[..., None] * np.array(color), 0, 255)
    return rendered, np.where(rendered.covered[..., None], picture, 0).astype(np.uint8)


def _facing(
    vertices: Float[np.ndarray, 'n 3'],
    f: Int[np.ndarray, 'm 3'],
    camera: Camera,
    rendered: RenderedDepth,
) -> Float32[np.ndarray, 'h w']:
    """Return how much each pixel's surface faces the light, 0..1 (Lambert 1760)."""
    v, u = np.nonzero(rendered.covered)
    corners = vertices[f[rendered.face[v, u]]]
    uv = np.column_stack([u, v]).astype(np.float64)
    points = camera.unproject(uv, rendered.depth_m[v, u].astype(np.float64))
    normals = vertex_normals(vertices, f)[f[rendered.face[v, u]]]
    smooth = np.einsum('nk,nkc->nc', _barycentric(points, corners), normals)
    length = np.maximum(np.linalg.norm(smooth, axis=1), 1e-9)
    facing = np.zeros(rendered.depth_m.shape, dtype=np.float32)
    facing[v, u] = np.clip(smooth @ LIGHT / length, 0, 1)
    return facing


def _barycentric(
    points: Float[np.ndarray, 'n 3'], corners: Float[np.ndarray, 'n 3 3']
) -> Float[np.ndarray, 'n 3']:
    """Return the weights of a triangle's corners at points of its plane, clipped to it."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    area = np.maximum(np.einsum('nk,nk->n', normal, normal), 1e-18)
    wb = np.einsum('nk,nk->n', np.cross(points - a, c - a), normal) / area
    wc = np.einsum('nk,nk->n', np.cross(b - a, points - a), normal) / area
    return np.clip(np.column_stack([1 - wb - wc, wb, wc]), 0, 1)
