"""Several bags read as one, in order of time, from a start for a duration.

Cameras are recorded into one bag, into parts of it, or with a bag per topic: whatever was recorded
first comes first.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType

from pop_ros.bag_reader import BagError, BagMessage, BagReader, BagTopic

INFO = 'sensor_msgs/msg/CameraInfo'
STATIC_TF = '/tf_static'


@dataclass(frozen=True, slots=True)
class BagPart:
    """A part of a recording.

    Args:
        start_s: Where it begins, after the first message of the recording [s].
        duration_s: How long it is [s], or None up to the end.
    """

    start_s: float = 0.0
    duration_s: float | None = None

    @property
    def is_all(self) -> bool:
        """Return whether it is the whole recording."""
        return not self.start_s and self.duration_s is None

    def bounds_ns(self, first_ns: int) -> tuple[int | None, int | None]:
        """Return first and last time [ns] of a recording that begins at `first_ns`."""
        if self.is_all:
            return None, None
        start_ns = first_ns + round(self.start_s * 1e9)
        if self.duration_s is None:
            return start_ns, None
        return start_ns, start_ns + round(self.duration_s * 1e9)


class MergedBags:
    """Open bags that read like one."""

    def __init__(self, paths: Sequence[Path], part: BagPart | None = None) -> None:
        """Name bags, each a file or the folder of a rosbag2.

        Raises:
            BagError: If one of them is not there.
        """
        self._bags = [BagReader(path) for path in paths]
        self._part = part or BagPart()
        self._stack = ExitStack()
        self._bounds_ns: tuple[int | None, int | None] = (None, None)
        self.topics: list[BagTopic] = []

    def __enter__(self) -> MergedBags:
        """Open the bags.

        Raises:
            BagError: If nothing in one of them can be read, or the part begins behind the end.
        """
        with ExitStack() as stack:
            for bag in self._bags:
                stack.enter_context(bag)
            counts = Counter[tuple[str, str]]()
            for bag in self._bags:
                counts.update({(topic.name, topic.kind): topic.count for topic in bag.topics})
            self.topics = [BagTopic(*key, count) for key, count in sorted(counts.items())]
            self._bounds_ns = self._bounds()
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the bags."""
        self._stack.close()

    @property
    def name(self) -> str:
        """Return the bags' paths."""
        return ' and '.join(bag.name for bag in self._bags)

    @property
    def damage(self) -> str:
        """Return what was wrong with which bag, as far as they have been read."""
        damaged = [bag for bag in self._bags if bag.damage]
        if len(self._bags) == 1:
            return ''.join(bag.damage for bag in damaged)
        return '; '.join(f'{bag.name}: {bag.damage}' for bag in damaged)

    def first(self, topic: str) -> BagMessage | None:
        """Return the first message of a topic, be it before the part that is read."""
        found = [message for bag in self._bags if (message := bag.first(topic)) is not None]
        return min(found, key=lambda message: message.time_ns, default=None)

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Yield the messages of some topics in order of time, up to the damage of each bag.

        What is said once and holds from then on, a CameraInfo or fixed transforms, comes first,
        if it was said before the part that is read.
        """
        yield from self._said_before(topics)
        yield from heapq.merge(
            *(bag.messages(topics, *self._bounds_ns) for bag in self._bags),
            key=lambda message: message.time_ns)

    def _said_before(self, topics: Collection[str]) -> Iterator[BagMessage]:
        start_ns, _ = self._bounds_ns
        if start_ns is None:
            return
        for topic in self.topics:
            if topic.name not in topics:
                continue
            found: list[BagMessage] = []
            if topic.name == STATIC_TF:  # every publisher said its own
                found = [m for bag in self._bags
                         for m in bag.messages([STATIC_TF], None, start_ns)]
            elif topic.kind == INFO and (first := self.first(topic.name)) is not None:
                found = [first]
            yield from (replace(m, time_ns=start_ns) for m in found if m.time_ns < start_ns)

    def unused(self, topics: Collection[str]) -> list[str]:
        """Return the bags that hold none of some topics."""
        return [bag.name for bag in self._bags
                if not any(topic.name in topics and topic.count for topic in bag.topics)]

    def _bounds(self) -> tuple[int | None, int | None]:
        if self._part.is_all:
            return None, None
        spans = [span for bag in self._bags if (span := bag.span_ns()) is not None]
        first_ns = min((first for first, _ in spans), default=0)
        last_ns = max((last for _, last in spans), default=0)
        start_ns, stop_ns = self._part.bounds_ns(first_ns)
        assert start_ns is not None
        if start_ns > last_ns:
            raise BagError(
                f'{self.name}: expected a start within {(last_ns - first_ns) / 1e9:.3f} s, found '
                f'{self._part.start_s:g} s')
        return start_ns, stop_ns
