"""What a body model is, in numbers a user can judge: size, evenness, closedness, volume."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.model import BodyModel


@dataclass(frozen=True, slots=True)
class MeshFacts:
    """One triangle mesh.

    Args:
        vertices: Number of vertices.
        faces: Number of triangles.
        mean_edge_m: Mean length of an edge [m].
        edge_spread: Standard deviation of edge lengths over their mean.
        closed: Whether every edge joins exactly two triangles.
        volume_m3: Enclosed volume [m^3]; positive where faces look outward.
    """

    vertices: int
    faces: int
    mean_edge_m: float
    edge_spread: float
    closed: bool
    volume_m3: float


def mesh_facts(vertices: Float[np.ndarray, 'n 3'], f: Int[np.ndarray, 'm 3']) -> MeshFacts:
    """Measure a triangle mesh."""
    every = np.sort(np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(every, axis=0, return_counts=True)
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    a, b, c = (vertices[f[:, corner]] for corner in range(3))
    return MeshFacts(
        vertices=len(vertices),
        faces=len(f),
        mean_edge_m=float(length.mean()),
        edge_spread=float(length.std() / length.mean()),
        closed=bool((uses == 2).all()),
        # Divergence theorem: one sixth of the triple product per triangle.
        volume_m3=float((a * np.cross(b, c)).sum() / 6),
    )


def stature_m(model: BodyModel, betas: Float[np.ndarray, 'b']) -> float:
    """Return the height of a body in T-pose [m]."""
    height = model.v_template[:, 1] + model.shapedirs[:, 1] @ betas
    return float(np.ptp(height))
