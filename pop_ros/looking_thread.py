"""A thread that asks the keypoint source while the worker follows people.

Networks leave the interpreter to others while they compute. The thread is a daemon, unlike those
of `concurrent.futures`: a source that never answers cannot keep a stopped node alive.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, TypeVar

AnswerT = TypeVar('AnswerT')
Job = tuple['Future[Any]', Callable[[], Any]]


class LookingThread:
    """Does one thing after the other, in the order given."""

    def __init__(self) -> None:
        """Start the thread."""
        self._jobs: queue.SimpleQueue[Job | None] = queue.SimpleQueue()
        self._began_s: float | None = None
        self._thread = threading.Thread(target=self._work, name='pop looking', daemon=True)
        self._thread.start()

    @property
    def busy_s(self) -> float:
        """Return for how long it has been doing the same thing [s], 0 while there is nothing."""
        began_s = self._began_s
        return 0.0 if began_s is None else time.monotonic() - began_s

    def submit(self, look: Callable[[], AnswerT]) -> Future[AnswerT]:
        """Have something done; its error, if any, is the future's."""
        future: Future[AnswerT] = Future()
        self._jobs.put((future, look))
        return future

    def stop(self, timeout_s: float) -> bool:
        """End the thread once what was submitted is done; return whether it was in time."""
        self._jobs.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            future, look = job
            self._began_s = time.monotonic()
            try:
                future.set_result(look())
            except Exception as error:  # noqa: BLE001 - whoever waits for the answer is told
                future.set_exception(error)
            self._began_s = None
