"""Thin a triangle mesh to a subset of its own vertices by half-edge collapses (metres).

A vertex never moves: it is merged into a neighbour or it stays. So whatever is defined on the
vertices of the fine mesh (skinning weights, shape directions) holds on the coarse one by indexing.
"""

import heapq

import numpy as np
from jaxtyping import Float, Int

# Share of an edge's length that counts as error: keeps flat regions from being emptied.
SPREAD = 0.2
# A collapse may turn a neighbouring face by at most acos(0.3) = 73 degrees.
MIN_TURN_COSINE = 0.3


def decimate(
    vertices: Float[np.ndarray, 'v 3'], faces: Int[np.ndarray, 'f 3'], target: int
) -> tuple[Int[np.ndarray, ' n'], Int[np.ndarray, 'm 3']]:
    """Collapse the cheapest edges until `target` vertices are left (Garland and Heckbert 1997).

    The cost of merging u into v is the mean squared distance of v to the planes of all faces
    gathered by both, plus (SPREAD * edge length)^2.

    Args:
        vertices: Positions of the fine mesh [m].
        faces: Its triangles, each vertex in one fan (a manifold, with or without border).
        target: Number of vertices to keep; more stay where no legal collapse is left.

    Returns:
        Indices of the kept vertices, ascending, and the triangles as indices into them.
    """
    mesh = _CollapsibleMesh(vertices.astype(np.float64), faces)
    mesh.collapse_until(target)
    triangles = np.array([face for face in mesh.faces if face is not None], dtype=np.int64)
    kept = np.unique(triangles)
    return kept, np.searchsorted(kept, triangles)


class _CollapsibleMesh:
    """Faces, the faces around each vertex, and each vertex's quadric."""

    def __init__(self, points: np.ndarray, faces: np.ndarray) -> None:
        self.points = points
        self.faces: list[tuple[int, int, int] | None] = [
            (int(a), int(b), int(c)) for a, b, c in faces
        ]
        self.fans: list[set[int]] = [set() for _ in points]
        for index, face in enumerate(faces.tolist()):
            for vertex in face:
                self.fans[vertex].add(index)
        self.quadrics, self.areas = _vertex_quadrics(points, faces)
        self.monomials = _monomials(points)
        # Counts the merges into a vertex: a queued edge of another age is outdated.
        self.age = [0] * len(points)
        self.heap: list[tuple[float, int, int, int, int]] = []

    def collapse_until(self, target: int) -> None:
        alive = sum(1 for fan in self.fans if fan)
        for vertex in range(len(self.fans)):
            later = [other for other in self._neighbours(vertex) if other > vertex]
            self._push_edges_of(vertex, later)
        while alive > target and self.heap:
            _, removed, stays, *ages = heapq.heappop(self.heap)
            outdated = ages != [self.age[removed], self.age[stays]]
            if not outdated and self.fans[removed] and self._is_legal(removed, stays):
                self._collapse(removed, stays)
                alive -= 1

    def _neighbours(self, vertex: int) -> set[int]:
        around = {other for index in self.fans[vertex] for other in self._face(index)}
        around.discard(vertex)
        return around

    def _face(self, index: int) -> tuple[int, int, int]:
        face = self.faces[index]
        assert face is not None  # fans hold living faces only
        return face

    def _push_edges_of(self, vertex: int, ring: list[int]) -> None:
        """Queue both collapses of each edge between a vertex and the given neighbours."""
        quadrics = self.quadrics[ring] + self.quadrics[vertex]
        areas = self.areas[ring] + self.areas[vertex]
        length_m2 = ((self.points[ring] - self.points[vertex]) ** 2).sum(1)
        into_ring = _cost(quadrics, self.monomials[ring], areas, length_m2)
        into_vertex = _cost(quadrics, self.monomials[vertex], areas, length_m2)
        for other, leave, enter in zip(ring, into_ring, into_vertex, strict=True):
            here, there = self.age[vertex], self.age[other]
            heapq.heappush(self.heap, (leave, vertex, other, here, there))
            heapq.heappush(self.heap, (enter, other, vertex, there, here))

    def _is_legal(self, removed: int, stays: int) -> bool:
        shared = self.fans[removed] & self.fans[stays]
        around = self._neighbours(removed)
        common = around & self._neighbours(stays)
        # Link condition: only the tips of the shared faces may neighbour both ends.
        if len(common) != len(shared) or len(shared) not in (1, 2):
            return False
        on_border = len(around) != len(self.fans[removed])
        # A border vertex may only slide along the border, an inner edge has two faces.
        if on_border != (len(shared) == 1):
            return False
        if any(len(self.fans[tip]) < 4 for tip in common):
            return False
        return self._keeps_orientation(removed, stays, self.fans[removed] - shared)

    def _keeps_orientation(self, removed: int, stays: int, turned: set[int]) -> bool:
        if not turned:
            return False
        old = np.array([self._face(index) for index in turned])
        new = np.where(old == removed, stays, old)
        before, after = _normals(self.points, old), _normals(self.points, new)
        lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
        return bool(((before * after).sum(1) > MIN_TURN_COSINE * lengths).all())

    def _collapse(self, removed: int, stays: int) -> None:
        for index in self.fans[removed] & self.fans[stays]:
            for vertex in self._face(index):
                if vertex != removed:
                    self.fans[vertex].discard(index)
            self.faces[index] = None
        for index in self.fans[removed]:
            face = self.faces[index]
            if face is not None:
                a, b, c = (stays if vertex == removed else vertex for vertex in face)
                self.faces[index] = (a, b, c)
                self.fans[stays].add(index)
        self.fans[removed] = set()
        self.quadrics[stays] += self.quadrics[removed]
        self.areas[stays] += self.areas[removed]
        self.age[stays] += 1
        self._push_edges_of(stays, list(self._neighbours(stays)))


def _cost(
    quadrics: np.ndarray, monomials: np.ndarray, areas: np.ndarray, length_m2: np.ndarray
) -> list[float]:
    plane_m2 = np.maximum((quadrics * monomials).sum(1), 0.0) / areas
    cost: list[float] = (plane_m2 + SPREAD**2 * length_m2).tolist()
    return cost


def _normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return normals of length twice the area [m^2]."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a)


def _vertex_quadrics(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sum the area-weighted plane quadrics of the faces around each vertex, as 10 monomials."""
    normals = _normals(points, faces)
    areas = np.linalg.norm(normals, axis=1) / 2
    unit = normals / np.maximum(2 * areas, 1e-20)[:, None]
    offsets = -(unit * points[faces[:, 0]]).sum(1)
    planes = _monomials(unit, offsets) * areas[:, None]
    # Off-diagonal terms of p^T Q p appear twice.
    planes *= np.array([1, 1, 1, 1, 2, 2, 2, 2, 2, 2])
    quadrics, gathered = np.zeros((len(points), 10)), np.zeros(len(points))
    for corner in range(3):
        np.add.at(quadrics, faces[:, corner], planes)
        np.add.at(gathered, faces[:, corner], areas)
    return quadrics, np.maximum(gathered, 1e-20)


def _monomials(xyz: np.ndarray, w: np.ndarray | None = None) -> np.ndarray:
    """Return xx yy zz ww xy xz yz xw yw zw of homogeneous rows (w = 1 by default)."""
    x, y, z = xyz.T
    w = np.ones_like(x) if w is None else w
    columns = [x * x, y * y, z * z, w * w, x * y, x * z, y * z, x * w, y * w, z * w]
    return np.stack(columns, axis=1)
