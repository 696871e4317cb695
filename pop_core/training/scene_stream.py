"""Processes that draw training scenes without end, beside the training."""

from __future__ import annotations

from multiprocessing import get_context
from queue import Empty
from typing import TYPE_CHECKING, Any

from pop_core.training.scene_writer import SceneKind, scene_stream
from pop_core.training.shards import Shard, ShardError, pack

if TYPE_CHECKING:
    from types import TracebackType

PIECE = 64  # scenes handed over at once


class SceneStream:
    """Scenes of as many processes as cores are free, in no particular order."""

    def __init__(self, workers: int, seed: int, kind: SceneKind) -> None:
        """Start the processes.

        Args:
            workers: Number of processes.
            seed: Decides what each of them draws.
            kind: Which scenes.
        """
        context = get_context('spawn')  # the parent may hold a GPU, which no fork survives
        self._queue: Any = context.Queue(maxsize=4 * workers)
        self._workers = [
            context.Process(
                target=_draw_forever, daemon=True,
                args=(self._queue, seed * 1000 + k, kind))
            for k in range(workers)]
        for worker in self._workers:
            worker.start()

    def __enter__(self) -> SceneStream:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the processes."""
        for worker in self._workers:
            worker.terminate()
            worker.join()

    def take(self, timeout_s: float | None = None) -> Shard | None:
        """Return a piece of scenes; None when none came in time (at once without a timeout).

        Raises:
            ShardError: If a process has ended, which none does by itself.
        """
        try:
            piece: Shard = self._queue.get(block=timeout_s is not None, timeout=timeout_s)
        except Empty:
            ended = [worker.exitcode for worker in self._workers if not worker.is_alive()]
            if ended:
                raise ShardError(
                    f'expected {len(self._workers)} processes that draw scenes, found '
                    f'{len(ended)} ended with {ended}: their own messages stand above') from None
            return None
        return piece


def _draw_forever(queue: Any, seed: int, kind: SceneKind) -> None:
    scenes = scene_stream(kind, seed)
    while True:
        queue.put(pack([scenes.draw() for _ in range(PIECE)]))
