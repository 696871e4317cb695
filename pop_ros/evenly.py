"""Keep a few things, evenly spread, of many that come one by one."""

from __future__ import annotations

from typing import Generic, TypeVar

import numpy as np

ItemT = TypeVar('ItemT')


class Evenly(Generic[ItemT]):
    """At most twice `count` of the items seen so far, evenly spread, and the last one."""

    def __init__(self, count: int) -> None:
        """Say how many are wanted in the end."""
        self._count, self._step, self._seen = count, 1, 0
        self._kept: list[ItemT] = []
        self._last: list[ItemT] = []

    def add(self, item: ItemT) -> None:
        """Take the next item."""
        self._last = []
        if self._seen % self._step == 0:
            self._kept.append(item)
        else:
            self._last = [item]
        self._seen += 1
        if len(self._kept) > 2 * self._count:
            self._last = self._last or self._kept[-1:]
            self._kept, self._step = self._kept[::2], 2 * self._step

    def chosen(self) -> list[ItemT]:
        """Return at most `count` of them, the first and the last among them."""
        items = self._kept + [item for item in self._last if item is not self._kept[-1]]
        at = np.unique(np.linspace(0, len(items) - 1, min(self._count, len(items))).astype(int))
        return [items[i] for i in at]
