"""Where the files of a library are converted: in this process, in others, or on a Ray cluster."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from importlib import import_module
from typing import Any

from pop_core.body.model import BodyModel
from pop_core.errors import LibraryFileError
from pop_core.retrieval.library_builder import BuildOptions, PoseSource, convert

BATCH_FILES = 8  # files per task: small files would otherwise cost more to send than to read
IN_FLIGHT = 4  # batches per worker that wait or run: bounds the memory of results
Result = tuple[int, Any]
Batch = list[tuple[int, PoseSource]]


def run_here(
    sources: Sequence[PoseSource], options: BuildOptions, model: BodyModel
) -> Iterator[Result]:
    """Convert one file after the other."""
    for position, source in enumerate(sources):
        yield position, convert(source, options, model)


class ProcessRunner:
    """Converts files in processes of this machine."""

    def __init__(self, jobs: int) -> None:
        """Use at most `jobs` processes."""
        self.jobs = jobs

    def __call__(
        self, sources: Sequence[PoseSource], options: BuildOptions, model: BodyModel
    ) -> Iterator[Result]:
        """Yield results as they come."""
        if self.jobs == 1 or len(sources) <= 1:
            yield from run_here(sources, options, model)
            return
        # Fresh interpreters: a fork would copy the locks of threads it does not copy.
        context = multiprocessing.get_context('spawn')
        batches = iter(_batches(sources))
        with ProcessPoolExecutor(
            self.jobs, mp_context=context, initializer=_set_model, initargs=(model,)
        ) as pool:
            waiting = {
                pool.submit(_convert_batch, batch, options)
                for batch, _ in zip(batches, range(IN_FLIGHT * self.jobs), strict=False)
            }
            while waiting:
                finished = next(as_completed(waiting))
                waiting.remove(finished)
                batch = next(batches, None)
                if batch is not None:
                    waiting.add(pool.submit(_convert_batch, batch, options))
                yield from finished.result()


class RayRunner:
    """Converts files on a Ray cluster whose nodes see the same folders."""

    def __init__(self, address: str) -> None:
        """Connect to a cluster; 'local' starts one on this machine.

        Raises:
            LibraryFileError: If Ray is not installed or does not answer.
        """
        try:
            ray = import_module('ray')
        except ImportError as error:
            raise LibraryFileError(
                '--ray: expected the optional package ray (pip install "pop_ros[ray]"), '
                'found none') from error
        self.ray = ray
        if not ray.is_initialized():
            ray.init(
                address=address, include_dashboard=False, log_to_driver=False,
                configure_logging=False)

    def __call__(
        self, sources: Sequence[PoseSource], options: BuildOptions, model: BodyModel
    ) -> Iterator[Result]:
        """Yield results as they come."""
        ray = self.ray
        task = ray.remote(_convert_batch_with)
        shared = ray.put(model)
        batches = iter(_batches(sources))
        limit = IN_FLIGHT * max(1, int(ray.cluster_resources().get('CPU', 1)))
        waiting = [
            task.remote(batch, options, shared)
            for batch, _ in zip(batches, range(limit), strict=False)
        ]
        while waiting:
            (finished, *_), waiting = ray.wait(waiting)
            batch = next(batches, None)
            if batch is not None:
                waiting.append(task.remote(batch, options, shared))
            yield from ray.get(finished)


_model: BodyModel | None = None


def _set_model(model: BodyModel) -> None:
    """Keep the model in a worker process, sent once: a pool hands things over in no other way."""
    global _model
    _model = model


def _convert_batch(batch: Batch, options: BuildOptions) -> list[Result]:
    if _model is None:
        raise LibraryFileError('expected a worker with a body model, found none')
    return _convert_batch_with(batch, options, _model)


def _convert_batch_with(batch: Batch, options: BuildOptions, model: BodyModel) -> list[Result]:
    return [(position, convert(source, options, model)) for position, source in batch]


def _batches(sources: Sequence[PoseSource]) -> list[Batch]:
    numbered = list(enumerate(sources))
    return [numbered[i: i + BATCH_FILES] for i in range(0, len(numbered), BATCH_FILES)]
