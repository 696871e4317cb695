"""What the node has done: frames, drops by reason, and times; written by two threads."""

from __future__ import annotations

import re
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pop_core.estimate import EstimateStatus

REMINDER_S = 5.0  # how often the same drop is said again
WINDOW = 100  # latest frames that rates and percentiles are taken from


def drop_reason(error: Exception) -> str:
    """Return the kind of an error in words: `BadMessageError` is 'bad message'."""
    name = type(error).__name__.removesuffix('Error')
    return re.sub(r'(?<!^)(?=[A-Z])', ' ', name).lower()


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A consistent copy of the counts.

    Args:
        taken_s: Steady time of the copy [s].
        pairs: Pairs handed to the worker.
        frames: Frames fitted.
        people: People fitted in all frames.
        latest_people: People in the latest frame.
        unfitted: People who were detected and gave no body, in all frames, by reason.
        drops: Pairs that gave no frame, by reason.
        refused: Pairs dropped because something was wrong with them.
        faults: Those of them that met a fault of the node itself.
        latest_drop: The latest drop in words.
        latency_ms: Latest times from arrival of a pair to publishing [ms].
        age_ms: Latest ages of the image stamp at publishing [ms].
        step_ms: Latest time of every step of the pipeline [ms].
    """

    taken_s: float
    pairs: int
    frames: int
    people: int
    latest_people: int
    unfitted: Mapping[str, int]
    drops: Mapping[str, int]
    refused: int
    faults: int
    latest_drop: str
    latency_ms: tuple[float, ...]
    age_ms: tuple[float, ...]
    step_ms: Mapping[str, tuple[float, ...]]

    @property
    def pending(self) -> int:
        """Return the pairs that are neither fitted nor dropped yet."""
        return self.pairs - self.frames - sum(self.drops.values())


@dataclass(slots=True)
class NodeStatistics:
    """Counts that the callbacks and the worker write."""

    pairs: int = 0
    frames: int = 0
    people: int = 0
    latest_people: int = 0
    refused: int = 0
    faults: int = 0
    latest_drop: str = ''
    drops: Counter[str] = field(default_factory=Counter)
    unfitted: Counter[str] = field(default_factory=Counter)
    _latency_ms: deque[float] = field(default_factory=lambda: deque(maxlen=WINDOW))
    _age_ms: deque[float] = field(default_factory=lambda: deque(maxlen=WINDOW))
    _step_ms: dict[str, deque[float]] = field(default_factory=dict)
    _said: dict[str, float] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def add_pair(self) -> None:
        """Count a pair handed to the worker."""
        with self._lock:
            self.pairs += 1

    def add_frame(
        self, people: int, latency_ms: float, age_ms: float, step_ms: Mapping[str, float],
        statuses: Sequence[EstimateStatus] = (),
    ) -> None:
        """Count a fitted frame, its times [ms], and what became of who was detected."""
        with self._lock:
            self.frames += 1
            self.people += people
            self.latest_people = people
            self.unfitted.update(
                status.value for status in statuses
                if status not in (EstimateStatus.OK, EstimateStatus.WAITING))
            self._latency_ms.append(latency_ms)
            self._age_ms.append(age_ms)
            for name, value in step_ms.items():
                self._step_ms.setdefault(name, deque(maxlen=WINDOW)).append(value)

    def add_drop(self, reason: str) -> None:
        """Count a pair that nobody needed any more."""
        with self._lock:
            self.drops[reason] += 1

    def add_refusal(self, reason: str, text: str, *, is_fault: bool = False) -> bool:
        """Count a pair that gave no frame; return whether to say so (first, then every 5 s).

        Args:
            reason: Kind of the drop in words.
            text: What was wrong.
            is_fault: Whether the node is to blame, and not the pair.
        """
        now = time.monotonic()
        kind = re.sub(r'\d+', '#', text)  # stamps and sizes make no new kind of drop
        with self._lock:
            self.drops[reason] += 1
            self.refused += 1
            self.faults += is_fault
            self.latest_drop = text
            due = now - self._said.get(kind, -np.inf) > REMINDER_S
            if due:
                self._said[kind] = now
            return bool(due)

    def snapshot(self) -> Snapshot:
        """Return a consistent copy."""
        with self._lock:
            return Snapshot(
                time.monotonic(), self.pairs, self.frames, self.people, self.latest_people,
                dict(self.unfitted), dict(self.drops), self.refused, self.faults, self.latest_drop,
                tuple(self._latency_ms), tuple(self._age_ms),
                {name: tuple(values) for name, values in self._step_ms.items()})
