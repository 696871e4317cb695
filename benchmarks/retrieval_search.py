"""How long an exact search takes, what it holds in memory, and whether an index is faster."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from pop_core.geometry.rotation import from_rotvec
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_file import ARRAYS, load_library, new_library_file
from pop_core.retrieval.pose_library import PoseLibrary
from pop_core.retrieval.procrustes import best_indices, rank_similarities
from pop_core.retrieval.retrieve import RetrievalConfig, retrieve

CHUNK = 100_000
JITTER_M = 0.03


def measure_search(poses: int, queries: int) -> list[dict[str, object]]:
    """Return times and memory of the default library and of a large memory-mapped one."""
    default = default_library()
    rows = [_search_row('default', default, queries, 0.0)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'large.poplib'
        write_large(path, default, poses)
        before = resident_mb()
        large = load_library(path)
        rows.append(_search_row('large', large, queries, before))
        del large
    return rows


def measure_shortlist(queries: int) -> list[dict[str, object]]:
    """Return exact search beside a k-d tree over rotation-free distances between joints.

    Only complete skeletons have a descriptor that an index can hold: with joints hidden, every
    visible set would need an index of its own.
    """
    library = default_library()
    descriptors = _descriptors(np.asarray(library.joints))
    start = time.perf_counter()
    tree = cKDTree(descriptors)
    built_s = time.perf_counter() - start
    exact_ms, tree_ms, shared = [], [], []
    for lifted in _queries(library, queries, hide=0):
        target, weight = lifted.positions_camera, np.ones(len(lifted.scores))
        start = time.perf_counter()
        costs = rank_similarities(library.columns, target, weight, (0.5, 1.25))
        best = best_indices(costs, 16)
        exact_ms.append(1e3 * (time.perf_counter() - start))
        start = time.perf_counter()
        _, near = tree.query(_descriptors(target[None])[0], k=256)
        tree_ms.append(1e3 * (time.perf_counter() - start))
        shared.append(len(set(best.tolist()) & set(near.tolist())) / 16)
    return [
        {'method': 'exact, any joints hidden', 'median [ms]': float(np.median(exact_ms)),
         'share of the best 16 found': 1.0, 'index [s]': 0.0},
        {'method': 'k-d tree, best 256, nothing hidden', 'median [ms]': float(np.median(tree_ms)),
         'share of the best 16 found': float(np.mean(shared)), 'index [s]': built_s},
    ]


def resident_mb() -> float:
    """Return the memory of this process [MB], file pages it has touched included."""
    for line in Path('/proc/self/status').read_text().splitlines():
        if line.startswith('VmRSS'):
            return int(line.split()[1]) / 1e3
    return float('nan')


def _search_row(
    name: str, library: PoseLibrary, queries: int, before_mb: float
) -> dict[str, object]:
    lifted = _queries(library, queries)
    retrieve(library, lifted[0])
    search_ms, whole_ms = [], []
    for item in lifted:
        weight = item.lifted / (0.02**2 + RetrievalConfig().pose_sigma_m**2)
        start = time.perf_counter()
        rank_similarities(library.columns, item.positions_camera, weight, (0.5, 1.25))
        search_ms.append(1e3 * (time.perf_counter() - start))
        start = time.perf_counter()
        retrieve(library, item)
        whole_ms.append(1e3 * (time.perf_counter() - start))
    return {
        'library': name, 'poses': len(library), 'search, median [ms]': float(np.median(search_ms)),
        'retrieve, median [ms]': float(np.median(whole_ms)),
        'retrieve, 90 % [ms]': float(np.quantile(whole_ms, 0.9)),
        'joints [MB]': library.columns.nbytes / 1e6,
        'resident [MB]': resident_mb() - before_mb if before_mb else float('nan'),
    }


def write_large(path: Path, library: PoseLibrary, poses: int) -> None:
    """Write jittered copies of a library until there are enough poses."""
    rng = np.random.default_rng(0)
    with new_library_file(path, poses, {'origin': 'benchmark'}) as arrays:
        for start in range(0, poses, CHUNK):
            part = slice(start, min(start + CHUNK, poses))
            rows = rng.integers(0, len(library), part.stop - part.start)
            for name in ARRAYS:
                if name == 'columns':
                    jitter = rng.normal(0, JITTER_M, (15, 3, len(rows))).astype(np.float32)
                    arrays[name][:, :, part] = library.columns[:, :, rows] + jitter
                else:
                    arrays[name][part] = getattr(library, name)[rows]


def _queries(library: PoseLibrary, queries: int, hide: int = 5) -> list[LiftedJoints]:
    """Return noisy library poses seen by a camera, some of the joints hidden."""
    rng = np.random.default_rng(1)
    out = []
    for row in rng.integers(0, len(library), queries):
        R = from_rotvec(np.array([np.pi, 0.0, 0.0])) @ from_rotvec(
            np.array([0.0, rng.uniform(-3, 3), 0.0]))
        joints = np.asarray(library.joints[row], dtype=np.float64) @ R.T + [0, 0, 3]
        joints += rng.normal(0, 0.02, joints.shape)
        sigma = np.full(15, 0.02)
        hidden = rng.choice(15, hide, replace=False)
        joints[hidden], sigma[hidden] = np.nan, np.inf
        out.append(LiftedJoints(
            joints, sigma, np.zeros(15, dtype=int), np.full((15, 2), np.nan), np.ones(15)))
    return out


def _descriptors(joints: np.ndarray) -> np.ndarray:
    """Return all distances between two joints, divided by their mean: free of any similarity."""
    first, second = np.triu_indices(joints.shape[1], 1)
    gaps = np.linalg.norm(joints[:, first] - joints[:, second], axis=2)
    return np.nan_to_num(gaps / np.nanmean(gaps, axis=1, keepdims=True)).astype(np.float32)
