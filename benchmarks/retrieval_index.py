"""Whether an approximate index (faiss, hnswlib) before the exact search is faster at equal recall.

An index compares vectors of one length by their Euclidean distance; retrieval compares skeletons
up to a similarity, any joints missing. Two choices make that fit:

- **Canonical frame.** Every complete skeleton is moved to its centroid, turned into the frame of
  its torso and divided by its size, so that poses differ by a plain distance and no Procrustes
  transform per pair is needed.
- **Missing joints are filled, not masked.** An index per visible set needs no guess, but there
  are 2^15 sets and building one index takes longer than hundreds of exact searches. Instead the
  visible joints are compared exactly with a few thousand poses of the library; each of the best
  lends its hidden joints once, and the index is asked for each skeleton thus completed: what is
  hidden has several likely places, whose mean would be like no pose at all.

The exact search then judges the shortlist by the joints that were seen. The methods take turns, a
few queries at a time: whatever else the computer does slows all of them alike.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.approximate_indices import HOW_TO_INSTALL, Index, installed_indices
from benchmarks.retrieval_recall import HIDDEN, held_back, seen_by_camera
from benchmarks.retrieval_search import write_large
from pop_core.body.joints import SHARED_INDEX
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_file import load_library
from pop_core.retrieval.procrustes import best_indices, rank_similarities, solve_similarities

SHORTLISTS = (256, 1024, 4096)
BEST = 16
SCALE_LIMITS = (0.5, 1.25)
PROTOTYPES, LENDERS = 4096, 8
CHUNK = 100_000
TURN = 10  # queries that a method answers before the next one


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """The joints of a library as each step wants them.

    Args:
        columns: Joints (15,3,m) [m] for the exact search of all.
        rows: The same joints (m,15,3), where those of a shortlist lie in few cache lines.
        prototypes: Joints (15,3,p) of the poses that lend their hidden joints.
    """

    columns: np.ndarray
    rows: np.ndarray
    prototypes: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Method:
    """One way to the best poses of a query, and what it cost beforehand.

    Args:
        name: What it is.
        listed: How many poses the exact search judges.
        best: Takes a query; returns the indices of its best poses.
        built_s: Building time [s].
        more_mb: Memory beyond the columns of the library [MB].
    """

    name: str
    listed: int
    best: Callable[[LiftedJoints], np.ndarray]
    built_s: float = 0.0
    more_mb: float = 0.0


def measure_index(mocap: Path, queries: int, size: int) -> list[dict[str, object]]:
    """Return time, share of the exact best 16, building time and memory of every method."""
    methods = _methods(_poses(size))
    if len(methods) == 1:
        print(HOW_TO_INSTALL)
        return []
    root, body = held_back(mocap, queries)
    rows: list[dict[str, object]] = [{'method': m.name, 'list': m.listed} for m in methods]
    for share in HIDDEN:
        asked = [lifted for lifted, _ in seen_by_camera(root, body, share)]
        for row, times, recalls in zip(rows, *_taken_in_turns(methods, asked), strict=True):
            row[f'{share:.0%} [ms]'] = float(np.median(times))
            row[f'{share:.0%} [%]'] = float(100 * np.mean(recalls))
    for row, method in zip(rows, methods, strict=True):
        row |= {'built [s]': method.built_s, 'more [MB]': method.more_mb}
    return rows


def canonical(joints: np.ndarray) -> np.ndarray:
    """Return complete skeletons (n,15,3) as vectors (n,45) that no similarity transform changes.

    Origin at the centroid, x to the person's left, y up the torso, root mean square distance from
    the centroid 1.
    """
    left, right, top, bottom = (
        joints[:, [SHARED_INDEX[name] for name in names]].mean(axis=1) for names in (
            ('left_shoulder', 'left_hip'), ('right_shoulder', 'right_hip'),
            ('neck', 'left_shoulder', 'right_shoulder'), ('pelvis', 'left_hip', 'right_hip')))
    y = _unit(top - bottom)
    across = left - right
    x = _unit(across - np.sum(across * y, axis=1, keepdims=True) * y)
    axes = np.stack([x, y, np.cross(x, y)], axis=2)
    centred = joints - joints.mean(axis=1, keepdims=True)
    size = np.sqrt(np.mean(np.sum(centred**2, axis=2), axis=1))
    turned = np.einsum('nkc,nca->nka', centred, axes) / size[:, None, None]
    return np.ascontiguousarray(turned.reshape(len(joints), -1), dtype=np.float32)


def completed(prototypes: np.ndarray, query: LiftedJoints) -> np.ndarray:
    """Return skeletons (q,15,3) of the joints seen and of hidden ones lent by like prototypes."""
    target, weight = query.positions_camera, _weight(query)
    seen = weight > 0
    if seen.all():
        return target[None]
    like = best_indices(rank_similarities(prototypes, target, weight, SCALE_LIMITS), LENDERS)
    points = prototypes[:, :, like].transpose(2, 0, 1).astype(np.float64)
    out = solve_similarities(
        points[:, seen], target[seen], weight[seen], SCALE_LIMITS).apply(points)
    out[:, seen] = target[seen]
    return out


def indexed_best(poses: Poses, index: Index, n: int, query: LiftedJoints) -> np.ndarray:
    """Return the best poses among the n that an index proposes."""
    vectors = canonical(completed(poses.prototypes, query))
    listed = np.unique(index.search(vectors, n // len(vectors)))
    listed = listed[listed >= 0]
    columns = np.ascontiguousarray(poses.rows[listed].transpose(1, 2, 0))
    return listed[exact_best(columns, query)]


def exact_best(columns: np.ndarray, query: LiftedJoints) -> np.ndarray:
    """Return the best poses among all columns."""
    costs = rank_similarities(columns, query.positions_camera, _weight(query), SCALE_LIMITS)
    return best_indices(costs, BEST)


def _poses(size: int) -> Poses:
    """Return the default library, or jittered copies of its poses where more are wanted."""
    library = default_library()
    columns = library.columns[:, :, :size]
    if size > len(library):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'large.poplib'
            write_large(path, library, size)
            columns = np.array(load_library(path).columns)
    rows = np.ascontiguousarray(columns.transpose(2, 0, 1))
    chosen = np.linspace(0, len(rows) - 1, min(PROTOTYPES, len(rows))).astype(int)
    return Poses(columns, rows, np.ascontiguousarray(columns[:, :, chosen]))


def _methods(poses: Poses) -> list[Method]:
    """Return the exact search, then every installed index with every length of its shortlist."""
    start = time.perf_counter()
    vectors = np.concatenate([
        canonical(poses.rows[i:i + CHUNK]) for i in range(0, len(poses.rows), CHUNK)])
    moved_s = time.perf_counter() - start
    methods = [Method('exact', len(vectors), lambda query: exact_best(poses.columns, query))]
    methods += [
        Method(
            index.name, n, partial(indexed_best, poses, index, n), moved_s + index.built_s,
            index.size_mb + poses.rows.nbytes / 1e6)
        for index in installed_indices(vectors) for n in SHORTLISTS
    ]
    return methods


def _taken_in_turns(
    methods: list[Method], queries: list[LiftedJoints]
) -> tuple[list[list[float]], list[list[float]]]:
    """Return times [ms] and shares of the first method's answers, by method and query."""
    times: list[list[float]] = [[] for _ in methods]
    shares: list[list[float]] = [[] for _ in methods]
    for start in range(0, len(queries), TURN):
        part = queries[start:start + TURN]
        truth = [methods[0].best(query) for query in part]
        for i, method in enumerate(methods):
            method.best(part[0])  # wakes threads and caches
            for query, right in zip(part, truth, strict=True):
                begun = time.perf_counter()
                found = method.best(query)
                times[i].append(1e3 * (time.perf_counter() - begun))
                shares[i].append(float(np.isin(right, found).mean()))
    return times, shares


def _weight(query: LiftedJoints) -> np.ndarray:
    """Return equal weights of the joints seen: an index cannot weigh them otherwise."""
    return query.lifted.astype(np.float64)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
