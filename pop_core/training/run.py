"""A run of training for some minutes: scenes in, checkpoints, figures and curves out."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor

from pop_core.training.augmentation import cropped, varied
from pop_core.training.curves import save_curves
from pop_core.training.scene_pool import ScenePool
from pop_core.training.scene_stream import SceneStream
from pop_core.training.scene_writer import SHARD_SCENES, SceneKind
from pop_core.training.shards import load_fitting, shard_paths
from pop_core.training.targets import Batch, make_targets
from pop_core.training.trainer import Trainer
from pop_core.training.validation import MapScores

FIRST_SCENES = 1024  # drawn before learning begins, when none are on disk
VALIDATION_BATCH = 64
REPORT_S = 15.0


@dataclass(frozen=True, slots=True)
class RunConfig:
    """Where a run reads and writes, and for how long.

    Args:
        out: Folder of checkpoint, history and curves; an earlier run there goes on.
        minutes: Length of the run.
        size: Width and height of the network's input [px].
        scenes: Folder of packed scenes, or None.
        validation: Folder of packed scenes never learned from.
        workers: Processes that draw fresh scenes meanwhile.
        mocap: File of captured poses for them.
        capacity: Most scenes kept.
        cooldown: Share of the run, at its end, in which the learning rate falls to nothing.
        save_every_s: Seconds between checkpoints.
        seed: Randomness.
    """

    out: Path
    minutes: float
    size: tuple[int, int] = (192, 160)
    scenes: Path | None = None
    validation: Path | None = None
    workers: int = 0
    mocap: Path | None = None
    capacity: int = 60_000
    cooldown: float = 0.0
    save_every_s: float = 240.0
    seed: int = 0


def train(trainer: Trainer, config: RunConfig, say: Callable[[str], None]) -> None:
    """Train for the run's minutes; `say` is told what happens, a line at a time."""
    checkpoint = config.out / 'checkpoint.pt'
    if checkpoint.exists():
        trainer.load(checkpoint)
        say(f'going on after {trainer.images} images')
    network = trainer.network.config
    seed = config.seed + trainer.images  # a run that goes on must not see the same scenes again
    kind = SceneKind(config.size, network.focal_px, network.shown_at_m, config.mocap)
    with SceneStream(config.workers, seed, kind) as stream:
        pool = _filled(config, trainer.device, stream, say)
        _loop(trainer, config, pool, stream, say)


def validate(trainer: Trainer, config: RunConfig) -> dict[str, float]:
    """Return the figures of the averaged network on the validation scenes, none without any."""
    if config.validation is None:
        return {}
    scores = MapScores()
    for path in shard_paths(config.validation):
        shard = load_fitting(path, config.size)
        pool = ScenePool(len(shard), torch.device('cpu'))
        pool.add(shard)
        for start in range(0, pool.count, VALIDATION_BATCH):
            rows = range(start, min(start + VALIDATION_BATCH, pool.count))
            batch = _on(_middle(pool.at(list(rows)), config.size), trainer.device)
            with torch.no_grad():
                maps = trainer.averaged(batch.depth_m[:, None])
            scores.add(maps, make_targets(batch))
    return scores.figures()


def _loop(
    trainer: Trainer, config: RunConfig, pool: ScenePool, stream: SceneStream,
    say: Callable[[str], None],
) -> None:
    generator = torch.Generator().manual_seed(config.seed + trainer.images)
    begin = told = saved = time.monotonic()
    end = begin + 60.0 * config.minutes
    already = trainer.images
    means = _Means()
    while (now := time.monotonic()) < end:
        while (piece := stream.take()) is not None:
            pool.add(piece)
        batch = pool.draw(trainer.config.batch, generator, trainer.most_hidden)
        left = (end - now) / (end - begin)
        factor = min(1.0, left / max(config.cooldown, 1e-9))
        means.add(trainer.step(varied(batch, config.size, generator), factor))
        if now - told > REPORT_S:
            told = now
            rate = (trainer.images - already) / (now - begin)
            say(f'{trainer.images} images, {rate:.0f}/s, {means.text()}')
        if now - saved > config.save_every_s:
            saved = now
            _record(trainer, config, means.taken(), say)
    _record(trainer, config, means.taken(), say)


class _Means:
    """Means of the terms of the loss since they were last taken."""

    def __init__(self) -> None:
        self._sums: dict[str, Tensor | float] = {}
        self._count = 0

    def add(self, terms: Mapping[str, Tensor]) -> None:
        for name, value in terms.items():
            self._sums[name] = self._sums.get(name, 0.0) + value
        self._count += 1

    def taken(self) -> dict[str, float]:
        means = {name: float(value) / self._count for name, value in self._sums.items()}
        self._sums, self._count = {}, 0
        return means

    def text(self) -> str:
        each = (f'{name} {float(value) / self._count:.3f}' for name, value in self._sums.items())
        return ', '.join(each)


def _record(
    trainer: Trainer, config: RunConfig, terms: dict[str, float], say: Callable[[str], None]
) -> None:
    """Write checkpoint, weights, history and curves."""
    figures = validate(trainer, config)
    trainer.history.append({'images': float(trainer.images), **terms, **figures})
    trainer.save(config.out / 'checkpoint.pt')
    trainer.save_weights(config.out / 'weights.pt')
    history = json.dumps(trainer.history, indent=1)
    (config.out / 'history.json').write_text(history + '\n', encoding='utf-8')
    save_curves(trainer.history, config.out / 'curves.png')
    if figures:
        say('validation: ' + ', '.join(f'{name} {value:.3f}' for name, value in figures.items()))


def _filled(
    config: RunConfig, device: torch.device, stream: SceneStream, say: Callable[[str], None]
) -> ScenePool:
    """Return a pool with the scenes on disk, or the first that the workers draw."""
    paths = shard_paths(config.scenes) if config.scenes is not None else []
    capacity = config.capacity
    if not config.workers:
        capacity = min(capacity, SHARD_SCENES * len(paths))
    pool = ScenePool(capacity, device)
    for path in paths[-(capacity // SHARD_SCENES):]:
        pool.add(load_fitting(path, config.size))
    while config.scenes is None and pool.count < FIRST_SCENES:
        piece = stream.take(timeout_s=5.0)
        if piece is not None:
            pool.add(piece)
    say(f'{pool.count} scenes to begin with')
    return pool


def _middle(batch: Batch, size: tuple[int, int]) -> Batch:
    left = (batch.depth_m.shape[2] - size[0]) // 2
    return cropped(batch, left, (batch.depth_m.shape[1] - size[1]) // 2, size)


def _on(batch: Batch, device: torch.device) -> Batch:
    return Batch(*(getattr(batch, name).to(device) for name in Batch.__slots__))
