"""Wall time per named step, summed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager


class Stopwatch:
    """Adds up the wall time [ms] of named steps."""

    def __init__(self) -> None:
        """Start with nothing measured."""
        self.times_ms: dict[str, float] = {}

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Measure the enclosed block under a name."""
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = 1e3 * (time.perf_counter() - start)
            self.times_ms[name] = self.times_ms.get(name, 0.0) + spent
