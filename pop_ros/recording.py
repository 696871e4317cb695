"""What is read from a recording, be it one bag or several."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Protocol

from pop_ros.bag_reader import BagMessage, BagTopic


class Recording(Protocol):
    """One bag, or several that read like one."""

    topics: list[BagTopic]

    @property
    def name(self) -> str:
        """Return where it lies."""

    @property
    def damage(self) -> str:
        """Return what was wrong with it, as far as it has been read."""

    def first(self, topic: str) -> BagMessage | None:
        """Return the first message of a topic."""

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Yield the messages of some topics in order of time."""
