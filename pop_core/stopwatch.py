"""Wall time per named step, summed."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager


class Stopwatch:
    """Adds up the wall time [ms] of named steps."""

    def __init__(self) -> None:
        """Start with nothing measured."""
        self.times_ms: dict[str, float] = {}

    def add(self, times_ms: Mapping[str, float]) -> None:
        """Add what another stopwatch measured."""
        for name, spent in times_ms.items():
            self.times_ms[name] = self.times_ms.get(name, 0.0) + spent

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Measure the enclosed block under a name."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.add({name: 1e3 * (time.perf_counter() - start)})
