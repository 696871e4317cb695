"""One worker thread that always works on the newest item, and does tasks in between."""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

ItemT = TypeVar('ItemT')


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Something to be done once, in the order given, before the next item."""

    run: Callable[[], None]


class Mailbox(Generic[ItemT]):
    """A slot for one item, which a newer one replaces, and a queue of tasks, which all count."""

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._item: ItemT | None = None
        self._tasks: deque[Task] = deque()
        self._closed = False

    def put(self, item: ItemT) -> bool:
        """Store an item; return whether it replaced one that was never taken."""
        with self._condition:
            replaced = self._item is not None
            self._item = item
            self._condition.notify()
            return replaced

    def clear(self) -> bool:
        """Drop the item that waits; return whether there was one."""
        with self._condition:
            waited, self._item = self._item is not None, None
            return waited

    def add(self, task: Task) -> None:
        """Queue a task."""
        with self._condition:
            self._tasks.append(task)
            self._condition.notify()

    def take(self) -> ItemT | Task | None:
        """Wait for a task or an item and take it; None once the mailbox is closed."""
        with self._condition:
            self._condition.wait_for(
                lambda: self._tasks or self._item is not None or self._closed)
            if self._tasks:
                return self._tasks.popleft()
            item, self._item = self._item, None
            return None if self._closed else item

    def close(self) -> None:
        """Wake the taker for the last time: tasks are still done, an item is dropped."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()


class Worker(Generic[ItemT]):
    """A thread that hands the newest item to a function and survives its errors."""

    def __init__(
        self,
        process: Callable[[ItemT], None],
        on_error: Callable[[Exception], None],
        prepare: Callable[[], None] | None = None,
    ) -> None:
        """Prepare the thread.

        Args:
            process: Called with each item taken.
            on_error: Told of every exception of `process`.
            prepare: Called once in the thread before the first item; its exceptions end the
                thread after `on_error` has been told.
        """
        self.mailbox: Mailbox[ItemT] = Mailbox()
        self._process, self._on_error, self._prepare = process, on_error, prepare
        # A daemon, so that an endless computation cannot keep a stopped node alive.
        self._thread = threading.Thread(target=self._run, name='pop worker', daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def call(self, run: Callable[[], None]) -> None:
        """Have something done in the thread, before the next item."""
        self.mailbox.add(Task(run))

    def stop(self, timeout_s: float) -> bool:
        """Ask the thread to end; return whether it did within `timeout_s`."""
        self.mailbox.close()
        if self._thread.is_alive():
            self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            if self._prepare is not None:
                self._prepare()
        except Exception as error:  # noqa: BLE001 - whatever it is, the node must say it
            self._on_error(error)
            return
        while (item := self.mailbox.take()) is not None:
            try:
                if isinstance(item, Task):
                    item.run()
                else:
                    self._process(item)
            except Exception as error:  # noqa: BLE001 - one bad frame must not end the node
                self._tell(error)

    def _tell(self, error: Exception) -> None:
        try:
            self._on_error(error)
        except Exception:  # noqa: BLE001 - nor must a failure to tell of it
            sys.excepthook(*sys.exc_info())
