"""Libraries from users' own pose files: convert each file, thin out, write one library.

Every file becomes a shard in a folder beside the library, written under its final name only when
complete: an interrupted build goes on where it stopped. Joining reads one shard at a time, so the
size of a library is bounded by the disk. Where files are converted is the caller's choice: here,
in other processes, or on a Ray cluster (`build_workers`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, Int

from pop_core.body.model import BodyModel
from pop_core.errors import LibraryFileError
from pop_core.retrieval.importers.bvh import read_bvh
from pop_core.retrieval.importers.clip import PoseClip
from pop_core.retrieval.importers.smpl_npz import read_smpl_npz
from pop_core.retrieval.importers.surreal import read_surreal
from pop_core.retrieval.library_file import new_library_file
from pop_core.retrieval.pose_library import pose_columns
from pop_core.retrieval.pruning import PoseThinner

PATTERNS = {'surreal': '*_info.mat', 'amass': '*.npz', 'npz': '*.npz', 'bvh': '*.bvh'}
NOT_MOTION = ('shape.npz', 'neutral_stagei.npz')  # shape files that AMASS puts beside motion
SAMPLE_POSES = 20_000
MOST_NAMED = 5  # files, where none can be read

Progress = Callable[[int, int], None]
Shard = dict[str, np.ndarray]
# Runs `convert` over sources, yields (position, shard or line of error) in any order.
Runner = Callable[[Sequence['PoseSource'], 'BuildOptions', BodyModel], Iterable[tuple[int, Any]]]


@dataclass(frozen=True, slots=True)
class PoseSource:
    """One file of poses and the reader it needs.

    Args:
        path: File.
        kind: 'surreal', 'amass', 'npz' or 'bvh'.
    """

    path: Path
    kind: str


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """What to take from the files.

    Args:
        every: Take every n-th frame.
        mirror: Add the mirror image of every pose.
        spacing_m: Leave out poses nearer than this mean joint distance [m] to a kept one; 0 keeps
            all.
    """

    every: int = 1
    mirror: bool = True
    spacing_m: float = 0.02


@dataclass(frozen=True, slots=True)
class BuildReport:
    """What became of the files.

    Args:
        files: Files found.
        failures: One line per file that could not be read.
        poses_read: Poses after `every` and mirroring.
        poses_kept: Poses in the library.
    """

    files: int
    failures: tuple[str, ...]
    poses_read: int
    poses_kept: int


def find_sources(kind: str, folder: Path) -> list[PoseSource]:
    """Return the files of a kind below a folder, in a fixed order; a file stands for itself.

    Raises:
        LibraryFileError: If there is none.
    """
    if folder.is_file():
        return [PoseSource(folder, kind)]
    paths = sorted(p for p in folder.rglob(PATTERNS[kind]) if p.name not in NOT_MOTION)
    if not paths:
        raise LibraryFileError(f'{folder}: expected files {PATTERNS[kind]}, found none')
    return [PoseSource(path, kind) for path in paths]


def convert(source: PoseSource, options: BuildOptions, model: BodyModel) -> Shard | str:
    """Return the arrays of one file's poses, or one line that says why there are none."""
    try:
        clip = read_clip(source, options, model)
    except (LibraryFileError, OSError, ValueError) as error:
        return f'{source.path}: {error}'.replace('\n', ' ')
    if options.mirror:
        clip = clip.with_mirror()
    columns = pose_columns(
        clip.body_pose.astype(np.float64), clip.tilt.astype(np.float64), model)
    return {
        'body_pose': clip.body_pose, 'tilt': clip.tilt, 'masks': clip.masks,
        'joints': np.ascontiguousarray(columns.transpose(2, 0, 1)),
    }


def read_clip(source: PoseSource, options: BuildOptions, model: BodyModel) -> PoseClip:
    """Return every n-th pose of one file.

    Raises:
        LibraryFileError: If it cannot be read.
    """
    if source.kind == 'bvh':
        return read_bvh(source.path, model, options.every)
    if source.kind == 'surreal':
        return read_surreal(source.path).every(options.every)
    up = 'z' if source.kind == 'amass' else None
    return read_smpl_npz(source.path, up).every(options.every)


def build_from_files(
    out: Path,
    sources: Sequence[PoseSource],
    options: BuildOptions,
    model: BodyModel,
    *,
    runner: Runner,
    progress: Progress | None = None,
) -> BuildReport:
    """Write a library of the poses of many files.

    Args:
        out: Library file to write.
        sources: Files.
        options: What to take from them.
        model: Body whose proportions the joints take.
        runner: Where files are converted.
        progress: Called with files done and files in all.

    Raises:
        LibraryFileError: If no file holds a pose.
    """
    folder = out.with_name(out.name + '.parts')
    folder.mkdir(parents=True, exist_ok=True)
    shards = [folder / shard_name(source, options) for source in sources]
    missing = [i for i, shard in enumerate(shards) if not shard.exists()]
    failures: list[str] = []
    done = len(sources) - len(missing)
    for position, result in runner([sources[i] for i in missing], options, model):
        if isinstance(result, str):
            failures.append(result)
        else:
            _save_shard(shards[missing[position]], result)
        done += 1
        if progress is not None:
            progress(done, len(sources))
    present = [shard for shard in shards if shard.exists()]
    if not present:
        folder.rmdir()
        raise LibraryFileError(_nothing_found(out, len(sources), sorted(failures)))
    read, kept = join_shards(out, present, options)
    for shard in folder.iterdir():
        shard.unlink()
    folder.rmdir()
    return BuildReport(len(sources), tuple(sorted(failures)), read, kept)


def _nothing_found(out: Path, n_files: int, failures: Sequence[str]) -> str:
    lines = [f'{out}: expected poses, found none in {n_files} files', *failures[:MOST_NAMED]]
    if len(failures) > MOST_NAMED:
        lines.append(f'and {len(failures) - MOST_NAMED} more')
    return '\n  '.join(lines)


def join_shards(out: Path, shards: Sequence[Path], options: BuildOptions) -> tuple[int, int]:
    """Write the poses of shards, thinned out, into one library; return poses read and kept."""
    rows = list(_kept_rows(shards, options.spacing_m))
    kept = sum(len(r) for _, r in rows)
    notes = {'origin': f'{len(shards)} files', 'spacing_m': str(options.spacing_m)}
    with new_library_file(out, kept, notes) as arrays:
        arrays['weights'][:] = 1.0
        start = 0
        for shard, (_, index) in zip(shards, rows, strict=True):
            part = slice(start, start + len(index))
            with np.load(shard) as data:
                for name in ('body_pose', 'tilt', 'masks'):
                    arrays[name][part] = data[name][index]
                arrays['columns'][:, :, part] = data['joints'][index].transpose(1, 2, 0)
            start = part.stop
    return sum(n for n, _ in rows), kept


def shard_name(source: PoseSource, options: BuildOptions) -> str:
    """Return a name that changes with the file and with what is taken from it."""
    stat = source.path.stat()
    text = f'{source} {stat.st_size} {stat.st_mtime_ns} {options.every} {options.mirror}'
    return hashlib.sha256(text.encode()).hexdigest()[:24] + '.npz'


def _kept_rows(
    shards: Sequence[Path], spacing_m: float
) -> Iterator[tuple[int, Int[np.ndarray, 'k']]]:
    """Yield each shard's number of poses and the rows to keep, in order."""
    thinner: PoseThinner | None = None
    if spacing_m > 0:
        total = sum(_length(shard) for shard in shards)
        thinner = PoseThinner(_sample(shards), spacing_m, total)
    for shard in shards:
        if thinner is None:
            n = _length(shard)
            yield n, np.arange(n)
        else:
            with np.load(shard) as data:
                joints = data['joints']
            yield len(joints), thinner.accept(joints)


def _sample(shards: Sequence[Path]) -> Float32[np.ndarray, 'n s 3']:
    """Return joints from shards spread over all, enough to lay a grid."""
    chosen = shards[:: max(1, len(shards) // 32)]
    parts = []
    for shard in chosen:
        with np.load(shard) as data:
            joints = data['joints']
        parts.append(joints[:: max(1, len(joints) * len(chosen) // SAMPLE_POSES)])
    return np.concatenate(parts)


def _length(shard: Path) -> int:
    with np.load(shard) as data:
        return len(data['masks'])


def _save_shard(path: Path, shard: Shard) -> None:
    partial = path.with_suffix('.part')
    with partial.open('wb') as file:
        np.savez(file, **shard)  # type: ignore[arg-type]
    partial.replace(path)
