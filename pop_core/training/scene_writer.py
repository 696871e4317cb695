"""Draw training scenes with all cores and write them as shards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from jaxtyping import Float

from pop_core.body.default_body import default_body
from pop_core.synthesis.coarse_body import coarse_body
from pop_core.synthesis.training_scenes import TrainingScenes
from pop_core.training.close_scenes import FINE_FOCAL_PX, FINE_SIZE, CloseScenes
from pop_core.training.shards import DAMAGED, MARGIN_PX, ShardError, load_fitting, pack, save_shard

SHARD_SCENES = 256


def load_motions(path: Path) -> list[Float[np.ndarray, '23 3']]:
    """Return the captured poses of an .npz file with `pose` (n, 24, 3), rotation vectors [rad].

    Raises:
        ShardError: If the file holds no such array.
    """
    try:
        with np.load(path, allow_pickle=False) as arrays:
            pose = arrays['pose'].astype(np.float64)
    except DAMAGED as error:
        raise ShardError(f'{path}: expected an array "pose" (n, 24, 3), found: {error}') from None
    if pose.ndim != 3 or pose.shape[1:] != (24, 3):
        raise ShardError(f'{path}: expected "pose" (n, 24, 3), found {pose.shape}')
    return list(pose[:, 1:])


@dataclass(frozen=True, slots=True)
class SceneKind:
    """Which scenes a network learns from.

    Args:
        size: Width and height of the network's input [px]; scenes are larger by a margin.
        focal_px: Focal length of the network's input [px].
        shown_at_m: Depth at which each person appears alone; None for the whole image.
        mocap: File of captured poses to draw from as well.
    """

    size: tuple[int, int]
    focal_px: float
    shown_at_m: float | None = None
    mocap: Path | None = None


def scene_stream(kind: SceneKind, seed: int) -> TrainingScenes | CloseScenes:
    """Return the endless stream of scenes of a seed."""
    motions = load_motions(kind.mocap) if kind.mocap is not None else ()
    model = coarse_body(default_body())
    width, height = (side + MARGIN_PX for side in kind.size)
    if kind.shown_at_m is None:
        return TrainingScenes(
            model, seed, width=width, height=height, focal_px=kind.focal_px, motions=motions)
    fine = TrainingScenes(
        model, seed, width=FINE_SIZE[0], height=FINE_SIZE[1], focal_px=FINE_FOCAL_PX,
        motions=motions)
    return CloseScenes(
        fine, seed, width=width, height=height, focal_px=kind.focal_px,
        shown_at_m=kind.shown_at_m)


def write_shards(
    folder: Path, count: int, *, seed: int, kind: SceneKind, workers: int = 1
) -> Iterator[int]:
    """Write at least `count` scenes and yield how many are done after every shard.

    Args:
        folder: Where `<seed>_<number>.npz` are written.
        count: Number of scenes, rounded up to whole shards.
        seed: Decides every scene, whatever the number of workers.
        kind: Which scenes.
        workers: Processes.

    Raises:
        ShardError: If what is there already was drawn for a network of another size.
    """
    jobs = [(folder / f'{seed:04d}_{k:05d}.npz', seed * 100_000 + k, kind)
            for k in range(-(-count // SHARD_SCENES))]
    kept = {path for path, *_ in jobs if path.exists()}
    if kept:
        load_fitting(min(kept), kind.size)
    todo = [job for job in jobs if job[0] not in kept]
    done = len(kept) * SHARD_SCENES
    if workers == 1:
        for job in todo:
            _write(job)
            done += SHARD_SCENES
            yield done
        return
    with get_context('spawn').Pool(workers) as pool:
        for _ in pool.imap_unordered(_write, todo):
            done += SHARD_SCENES
            yield done


def _write(job: tuple[Path, int, SceneKind]) -> None:
    path, seed, kind = job
    stream = scene_stream(kind, seed)
    save_shard(pack([stream.draw() for _ in range(SHARD_SCENES)]), path)
