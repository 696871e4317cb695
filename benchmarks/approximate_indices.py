"""Nearest-neighbour indices over vectors, from whichever of faiss and hnswlib are installed."""

from __future__ import annotations

import importlib
import importlib.util
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

HOW_TO_INSTALL = 'neither faiss nor hnswlib is installed: pip install faiss-cpu hnswlib'
THREADS = 2
LISTS_PROBED = 64
LINKS, EFFORT = 16, 100  # the usual size of a graph
ROUNDS = 10  # of k-means
SMALL = 400_000  # vectors above which a graph takes minutes to build, and comparing all is no use


@dataclass(frozen=True, slots=True, eq=False)
class Index:
    """How to ask an index, and what it cost.

    Args:
        name: What it is.
        search: Takes vectors (q,d) and a number n; returns the rows (q,n) of the nearest, -1
            where there are fewer.
        built_s: Building time [s].
        size_mb: Size of what it holds, the vectors included [MB].
    """

    name: str
    search: Callable[[np.ndarray, int], np.ndarray]
    built_s: float
    size_mb: float


def installed_indices(vectors: np.ndarray) -> list[Index]:
    """Return an index of each kind that is installed over float32 vectors (m,d)."""
    kinds: list[tuple[str, str, Callable[[Any, np.ndarray], Any]]] = [
        ('faiss', 'IVF', _inverted_lists)]
    if len(vectors) <= SMALL:
        kinds += [('hnswlib', 'HNSW', _graph), ('faiss', 'flat', _flat)]
    out = []
    for package, name, build in kinds:
        if importlib.util.find_spec(package) is not None:
            library = importlib.import_module(package)
            start = time.perf_counter()
            index = build(library, vectors)
            built_s = time.perf_counter() - start
            search = _ask_faiss(index) if package == 'faiss' else _ask_graph(index)
            out.append(Index(f'{package} {name}', search, built_s, _size_mb(library, index)))
    return out


def _flat(faiss: Any, vectors: np.ndarray) -> Any:
    """Compare every vector: the most that the vectors can tell, however they are indexed."""
    faiss.omp_set_num_threads(THREADS)
    index = faiss.IndexFlatL2(vectors.shape[1])
    index.add(vectors)
    return index


def _inverted_lists(faiss: Any, vectors: np.ndarray) -> Any:
    faiss.omp_set_num_threads(THREADS)
    lists = int(2 * np.sqrt(len(vectors)))
    index = faiss.index_factory(vectors.shape[1], f'IVF{lists},Flat')
    index.cp.niter, index.cp.max_points_per_centroid = ROUNDS, 64
    index.train(vectors)
    index.add(vectors)
    index.nprobe = LISTS_PROBED
    return index


def _graph(hnswlib: Any, vectors: np.ndarray) -> Any:
    index = hnswlib.Index(space='l2', dim=vectors.shape[1])
    index.init_index(max_elements=len(vectors), ef_construction=EFFORT, M=LINKS)
    index.set_num_threads(THREADS)
    index.add_items(vectors)
    return index


def _ask_faiss(index: Any) -> Callable[[np.ndarray, int], np.ndarray]:
    return lambda vectors, n: np.asarray(index.search(vectors, n)[1])


def _ask_graph(index: Any) -> Callable[[np.ndarray, int], np.ndarray]:
    def search(vectors: np.ndarray, n: int) -> np.ndarray:
        index.set_ef(max(n, LINKS))
        return np.asarray(index.knn_query(vectors, k=n)[0]).astype(np.int64)

    return search


def _size_mb(library: Any, index: Any) -> float:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / 'index'
        if hasattr(index, 'save_index'):
            index.save_index(str(path))
        else:
            library.write_index(index, str(path))
        return path.stat().st_size / 1e6
