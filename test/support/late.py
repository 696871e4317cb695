"""Somebody who works in the background, and finishes when told to."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

from pop_core.pipeline import BodyPipeline


class Late:
    """Does what it is asked for when it is told to."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future, Callable[..., Any], tuple[Any, ...]]] = []
        self.asked = 0
        self.pipeline: BodyPipeline | None = None

    def submit(self, work: Callable[..., Any], *inputs: Any) -> Future:
        self.asked += 1
        self.waiting.append((Future(), work, inputs))
        return self.waiting[-1][0]

    def finish(self) -> None:
        """Finish what waits."""
        for future, work, inputs in self.waiting:
            if future.set_running_or_notify_cancel():
                future.set_result(work(self.pipeline, *inputs))
        self.waiting.clear()

    def fail(self) -> None:
        """Fail to do what waits."""
        for future, *_ in self.waiting:
            if future.set_running_or_notify_cancel():
                future.set_exception(MemoryError())
        self.waiting.clear()
