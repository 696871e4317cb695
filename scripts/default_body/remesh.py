"""Spread vertices evenly over the half surface, finer on the hands, and mirror the result [m]."""

from dataclasses import dataclass

import numpy as np
import pymeshlab
import trimesh
from scipy.sparse import csr_matrix

from pop_core.body.joints import JOINT_INDEX

BODY_EDGE_M = 0.0185
FACE_EDGE_M = 0.012
# A fingertip is lost when long edges meet it: start fine, thin the hands by quadrics instead.
FINE_EDGE_M = 0.005
HAND_FACES = 820
HAND_LONGEST_EDGE_M = 0.012


@dataclass(frozen=True, eq=False)
class HalfMesh:
    """An even half surface that follows points of the source half surface."""

    vertices: np.ndarray  # (n, 3) [m]
    faces: np.ndarray  # (f, 3)
    rows: csr_matrix  # (n, n_source), barycentric weights in the source surface
    offsets: np.ndarray  # (n, 3), from there to the vertex: the socks over the toes [m]
    on_plane: np.ndarray  # (n,), vertices of the mirror plane

    def follow(self, source_vertices: np.ndarray) -> np.ndarray:
        """Return these vertices on people (p, n_source, 3) in the pose of this mesh [m]."""
        vertices = np.stack([self.rows @ person for person in source_vertices]) + self.offsets
        vertices[:, self.on_plane, 0] = 0.0
        return vertices


def remesh_half(
    vertices: np.ndarray, faces: np.ndarray, toes: np.ndarray, joints: np.ndarray
) -> HalfMesh:
    """Remesh isotropically (Botsch and Kobbelt 2004); the cut at x = 0 stays a straight border.

    Args:
        vertices: Source half surface in T-pose (n, 3) [m], border exactly on x = 0.
        faces: Its triangles.
        toes: Which of its vertices are toes (n,).
        joints: The 24 joints (24, 3) [m].
    """
    meshes = pymeshlab.MeshSet()
    _add_with_socks(meshes, vertices, faces, vertices[toes])
    _spread_evenly(meshes, joints)
    mesh = meshes.current_mesh()
    points, triangles = mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)
    on_plane = _border_vertices(triangles, len(points))
    points[on_plane, 0] = 0.0
    rows = _closest_rows(points, vertices, faces)
    offsets = points - rows @ vertices
    return HalfMesh(points, triangles, rows, offsets, on_plane)


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


def _add_with_socks(
    meshes: pymeshlab.MeshSet, vertices: np.ndarray, faces: np.ndarray, toes: np.ndarray
) -> None:
    """Unite the surface with the convex hull of its toes: single toes are finer than the mesh."""
    hull = trimesh.convex.convex_hull(toes)
    meshes.add_mesh(pymeshlab.Mesh(*_closed(vertices, faces)))
    for flip in (1.0, -1.0):
        body = meshes.current_mesh_id()
        turned = hull.faces[:, :: int(flip)]
        meshes.add_mesh(pymeshlab.Mesh(hull.vertices * (flip, 1, 1), turned))
        sock = meshes.current_mesh_id()
        meshes.generate_boolean_union(first_mesh=body, second_mesh=sock)
    united = meshes.current_mesh()
    points, triangles = united.vertex_matrix(), united.face_matrix()
    left = triangles[(points[triangles][:, :, 0] > -1e-9).all(1)]
    used = np.unique(left)
    meshes.add_mesh(pymeshlab.Mesh(points[used], np.searchsorted(used, left)))


def _closed(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    off_plane = np.flatnonzero(vertices[:, 0] != 0)
    twin = np.arange(len(vertices))
    twin[off_plane] = len(vertices) + np.arange(len(off_plane))
    return (
        np.concatenate([vertices, vertices[off_plane] * (-1, 1, 1)]),
        np.concatenate([faces, twin[faces][:, ::-1]]),
    )


def _spread_evenly(meshes: pymeshlab.MeshSet, joints: np.ndarray) -> None:
    wrist_x = joints[JOINT_INDEX['left_wrist'], 0]
    _, head_y, head_z = joints[JOINT_INDEX['head']]
    body = f'x0 < {wrist_x - 0.01}'
    no_face = f'{body} && (y0 < {head_y - 0.06} || z0 < {head_z + 0.03})'
    hand = f'x0 >= {wrist_x - 0.02}'
    _remesh(meshes, FINE_EDGE_M, crease_deg=60)
    _remesh(meshes, 0.008, body, crease_deg=60)
    _remesh(meshes, FACE_EDGE_M, body)
    _remesh(meshes, (BODY_EDGE_M * FACE_EDGE_M) ** 0.5, no_face)
    _remesh(meshes, BODY_EDGE_M, no_face, iterations=15)
    meshes.compute_selection_by_condition_per_face(condselect=hand)
    meshes.meshing_decimation_quadric_edge_collapse(
        targetfacenum=HAND_FACES, qualitythr=0.6, preservenormal=True, preservetopology=True,
        selected=True,
    )
    _remesh(meshes, HAND_LONGEST_EDGE_M, hand, iterations=3, crease_deg=180, collapseflag=False)


def _remesh(
    meshes: pymeshlab.MeshSet, edge_m: float, where: str = '', *, iterations: int = 8,
    crease_deg: float = 80, collapseflag: bool = True,
) -> None:
    if where:
        meshes.compute_selection_by_condition_per_face(condselect=where)
    meshes.meshing_isotropic_explicit_remeshing(
        iterations=iterations, targetlen=pymeshlab.PureValue(edge_m), featuredeg=crease_deg,
        checksurfdist=False, selectedonly=bool(where), collapseflag=collapseflag,
    )


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
