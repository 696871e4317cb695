"""How fast a user's library builds from files of the published formats."""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.pose_files import write_amass, write_bvh
from pop_core.body.default_body import default_body
from pop_core.retrieval.build_workers import ProcessRunner
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_builder import BuildOptions, build_from_files, find_sources

FRAMES_PER_FILE = 5000
STEPS = 25  # frames from one library pose to the next: motion, not jumps
JOBS = 2


def measure_build(poses: int) -> list[dict[str, object]]:
    """Return poses per second from AMASS and from BVH files, mirror images included."""
    rows = []
    for kind in ('amass', 'bvh'):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            files = _write_files(folder, kind, poses // 2)  # the mirror doubles them
            for spacing_m in (0.0, 0.02):
                rows.append(_row(folder, kind, files, spacing_m))
    return rows


def _row(folder: Path, kind: str, files: int, spacing_m: float) -> dict[str, object]:
    sources = find_sources(kind, folder)
    options = BuildOptions(spacing_m=spacing_m)
    start, busy_s = time.perf_counter(), cpu_s()
    report = build_from_files(
        folder / 'out.poplib', sources, options, default_body(), runner=ProcessRunner(JOBS))
    took_s, busy_s = time.perf_counter() - start, cpu_s() - busy_s
    return {
        'files': f'{files} {kind}', 'spacing [cm]': 100 * spacing_m, 'poses': report.poses_read,
        'kept': report.poses_kept, 'took [s]': took_s, 'poses/s': int(report.poses_read / took_s),
        'CPU [s]': busy_s, 'poses per CPU second': int(report.poses_read / busy_s),
    }


def cpu_s() -> float:
    """Return the processor time of this process and of its finished children [s]."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def _write_files(folder: Path, kind: str, poses: int) -> int:
    """Write motion that runs through library poses; return the number of files.

    Writing BVH text is slower than reading it, so files of one motion are copied; a file's name
    decides its shard, so every copy is read.
    """
    library, rest = default_library(), default_body().joint_template
    files = max(1, poses // FRAMES_PER_FILE)
    rng = np.random.default_rng(0)
    for i in range(min(files, 10)):
        keys = library.body_pose[rng.integers(0, len(library), FRAMES_PER_FILE // STEPS + 1)]
        share = np.linspace(0, 1, STEPS, endpoint=False)[None, :, None, None]
        body = ((1 - share) * keys[:-1, None] + share * keys[1:, None]).reshape(-1, 23, 3)
        root = np.zeros((len(body), 3))
        if kind == 'amass':
            write_amass(folder / f'{i}.npz', root, body.astype(np.float64))
        else:
            write_bvh(folder / f'{i}.bvh', root, body.astype(np.float64), rest)
    suffix = 'npz' if kind == 'amass' else 'bvh'
    for i in range(10, files):
        (folder / f'{i}.{suffix}').write_bytes((folder / f'{i % 10}.{suffix}').read_bytes())
    return files
