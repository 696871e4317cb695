"""Spread vertices evenly over the half surface, finer on the hands, and mirror the result [m]."""

from dataclasses import dataclass

import numpy as np
import pymeshlab
import trimesh
from scipy.sparse import csr_matrix

BODY_EDGE_M = 0.0178
HAND_EDGE_M = 0.0090
# Fingers vanish when they meet long edges: start fine, then coarsen all but the hands.
FINE_EDGES_M = (0.005, 0.007)


@dataclass(frozen=True, eq=False)
class HalfMesh:
    """An even half surface whose vertices are points of the source half surface."""

    vertices: np.ndarray  # (n, 3) [m]
    faces: np.ndarray  # (f, 3)
    rows: csr_matrix  # (n, n_source), barycentric weights in the source surface
    on_plane: np.ndarray  # (n,), vertices of the mirror plane


def remesh_half(vertices: np.ndarray, faces: np.ndarray, wrist_x_m: float) -> HalfMesh:
    """Remesh isotropically (Botsch and Kobbelt 2004); the cut at x = 0 stays a straight border."""
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces))
    for edge in (*FINE_EDGES_M, HAND_EDGE_M):
        _remesh(meshes, edge)
    _remesh(meshes, (BODY_EDGE_M * HAND_EDGE_M) ** 0.5, f'x0 < {wrist_x_m - 0.01}')
    _remesh(meshes, BODY_EDGE_M, f'x0 < {wrist_x_m - 0.02}')
    mesh = meshes.current_mesh()
    points, triangles = mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)
    on_plane = _border_vertices(triangles, len(points))
    points[on_plane, 0] = 0.0
    rows = _closest_rows(points, vertices, faces)
    return HalfMesh(rows @ vertices, triangles, rows, on_plane)


def mirror(half: HalfMesh) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Join the half with its mirror image.

    Returns:
        For each vertex of the whole its half vertex and its side (+1 left or midline, -1 right),
        the vertex it mirrors to, and the triangles.
    """
    n = len(half.vertices)
    off_plane = np.flatnonzero(~half.on_plane)
    origin = np.concatenate([np.arange(n), off_plane])
    side = np.concatenate([np.ones(n), -np.ones(len(off_plane))])
    twin = np.arange(n)
    twin[off_plane] = n + np.arange(len(off_plane))
    mirror_of = np.concatenate([twin, off_plane])
    faces = np.concatenate([half.faces, twin[half.faces][:, ::-1]])
    return origin, side, mirror_of, faces


def _remesh(meshes: pymeshlab.MeshSet, edge_m: float, where: str | None = None) -> None:
    if where is not None:
        meshes.compute_selection_by_condition_per_face(condselect=where)
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=10, targetlen=pymeshlab.PureValue(edge_m), featuredeg=60,
        checksurfdist=False, selectedonly=where is not None,
    )  # fmt: skip


def _border_vertices(faces: np.ndarray, count: int) -> np.ndarray:
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    on_border = np.zeros(count, dtype=bool)
    on_border[edges[uses == 1]] = True
    return on_border


def _closest_rows(points: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> csr_matrix:
    surface = trimesh.Trimesh(vertices, faces, process=False)
    closest, _, triangle = trimesh.proximity.closest_point(surface, points)
    weights = trimesh.triangles.points_to_barycentric(surface.triangles[triangle], closest)
    weights = np.maximum(weights, 0.0)
    weights /= weights.sum(1, keepdims=True)
    row = np.repeat(np.arange(len(points)), 3)
    return csr_matrix(
        (weights.ravel(), (row, faces[triangle].ravel())), shape=(len(points), len(vertices))
    )
