"""Pair colour and depth images by stamp. Colour is the clock; no ROS here, stamps in [ns].

An exact stamp wins at once. Otherwise the nearest depth within the slop is taken as soon as no
message still to come can be nearer, or when the colour image has waited long enough. Stamps, not
arrival, decide: when a bag loops or a clock jumps back, only the newest stamp is forgotten; images
of the previous run still find their partners, however the messages interleave.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from statistics import median
from typing import Generic, TypeVar

ItemT = TypeVar('ItemT')

MAX_COLORS = 10  # pending colour images; more means that depth has stopped
MAX_DEPTHS = 30  # a second of depth at 30 Hz
HOLD_NS = 2_000_000_000  # a depth image nobody wanted for this long belongs to the past
PATIENCE_NS = 250_000_000  # transport and registration delay of depth behind colour


@dataclass(frozen=True, slots=True)
class Pair(Generic[ItemT]):
    """A colour image and the depth image that belongs to it.

    Args:
        color: Colour item.
        depth: Depth item.
        stamp_ns: Stamp of the colour image [ns].
        skew_ns: Depth stamp minus colour stamp [ns].
    """

    color: ItemT
    depth: ItemT
    stamp_ns: int
    skew_ns: int


@dataclass(slots=True)
class Stream:
    """What is known of one stream of stamps.

    Args:
        count: Images seen.
        newest_ns: Newest stamp since the last jump back [ns].
        jumps_back: How often a stamp was older than the one before it.
        steps_ns: The latest forward steps between stamps [ns].
    """

    count: int = 0
    newest_ns: int | None = None
    jumps_back: int = 0
    steps_ns: deque[int] = field(default_factory=lambda: deque(maxlen=15))

    def see(self, stamp_ns: int) -> None:
        """Take note of a stamp; start anew when time jumped back."""
        previous, self.newest_ns = self.newest_ns, stamp_ns
        self.count += 1
        if previous is not None and stamp_ns < previous:
            self.jumps_back += 1
            self.steps_ns.clear()
        elif previous is not None:
            self.steps_ns.append(stamp_ns - previous)

    @property
    def period_ns(self) -> int:
        """Return the usual step [ns]; 0 while unknown."""
        return int(median(self.steps_ns)) if self.steps_ns else 0

    def has_passed(self, stamp_ns: int) -> bool:
        """Return whether every image still to come is newer than `stamp_ns`."""
        return self.newest_ns is not None and self.newest_ns >= stamp_ns


@dataclass(slots=True)
class PairStatistics:
    """Counts of one pairer since it was made.

    Args:
        pairs: Pairs delivered.
        missed: Colour images given up without a depth image.
        skews_ns: Depth minus colour stamp of the latest pairs [ns].
        missed_gap_ns: Distance of the nearest depth image of the latest miss [ns]; None when
            there was no depth image at all.
    """

    pairs: int = 0
    missed: int = 0
    skews_ns: deque[int] = field(default_factory=lambda: deque(maxlen=100))
    missed_gap_ns: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting(Generic[ItemT]):
    stamp_ns: int
    item: ItemT
    arrival_ns: int


class FramePairer(Generic[ItemT]):
    """Collects colour and depth images and hands out pairs in the order of colour stamps."""

    def __init__(self, slop_ns: int, statistics: PairStatistics | None = None) -> None:
        """Accept pairs whose stamps differ by at most `slop_ns` [ns]; count on in `statistics`."""
        self.slop_ns = slop_ns
        self.wait_ns = slop_ns + PATIENCE_NS
        self.color_stream = Stream()
        self.depth_stream = Stream()
        self.statistics = statistics or PairStatistics()
        self._colors: list[_Waiting[ItemT]] = []
        self._depths: list[_Waiting[ItemT]] = []
        # Those of used images too: a miss is explained by where depth was, not by what is left.
        self._depth_stamps: deque[int] = deque(maxlen=MAX_DEPTHS)

    def add_color(self, stamp_ns: int, item: ItemT, now_ns: int) -> list[Pair[ItemT]]:
        """Store a colour image that arrived at `now_ns` (any steady clock); return new pairs."""
        self.color_stream.see(stamp_ns)
        self._colors.append(_Waiting(stamp_ns, item, now_ns))
        while len(self._colors) > MAX_COLORS:
            self._miss(self._colors[0])
        return self._decide(now_ns)

    def add_depth(self, stamp_ns: int, item: ItemT, now_ns: int) -> list[Pair[ItemT]]:
        """Store a depth image that arrived at `now_ns`; return new pairs."""
        self.depth_stream.see(stamp_ns)
        self._depth_stamps.append(stamp_ns)
        kept = [d for d in self._depths
                if d.stamp_ns != stamp_ns and now_ns - d.arrival_ns <= HOLD_NS]
        self._depths = [*kept, _Waiting(stamp_ns, item, now_ns)][-MAX_DEPTHS:]
        return self._decide(now_ns)

    def poll(self, now_ns: int) -> list[Pair[ItemT]]:
        """Return pairs of colour images that have waited long enough."""
        return self._decide(now_ns)

    def flush(self) -> list[Pair[ItemT]]:
        """Decide every pending colour image with the depth images at hand."""
        return self._decide(None)

    def _decide(self, now_ns: int | None) -> list[Pair[ItemT]]:
        """Pair what can be decided; `now_ns` None decides everything."""
        pairs = []
        for color in sorted(self._colors, key=lambda c: c.stamp_ns):
            overdue = now_ns is None or now_ns - color.arrival_ns > self.wait_ns
            depth = self._nearest_depth(color)
            if depth is None:
                if overdue:
                    self._miss(color)
            elif overdue or self._is_final(color.stamp_ns, depth.stamp_ns):
                pairs.append(self._take(color, depth))
        return pairs

    def _nearest_depth(self, color: _Waiting[ItemT]) -> _Waiting[ItemT] | None:
        """Return the nearest depth within the slop that no other colour image is nearer to."""
        def gap(depth: _Waiting[ItemT]) -> int:
            return abs(depth.stamp_ns - color.stamp_ns)

        def is_wanted_more(depth: _Waiting[ItemT]) -> bool:
            return any(abs(depth.stamp_ns - c.stamp_ns) < gap(depth) for c in self._colors)

        allowed = [d for d in self._depths if gap(d) <= self.slop_ns and not is_wanted_more(d)]
        return min(allowed, key=gap, default=None)

    def _is_final(self, color_ns: int, depth_ns: int) -> bool:
        """Return whether nothing still to come can be nearer to either of the two."""
        gap = abs(depth_ns - color_ns)
        depth_settled = (
            2 * gap <= self.depth_stream.period_ns
            or self.depth_stream.has_passed(color_ns + gap))
        color_settled = (
            depth_ns <= color_ns
            or 2 * gap <= self.color_stream.period_ns
            or self.color_stream.has_passed(depth_ns + gap))
        return depth_settled and color_settled

    def _take(self, color: _Waiting[ItemT], depth: _Waiting[ItemT]) -> Pair[ItemT]:
        self._colors.remove(color)
        self._depths.remove(depth)
        skew_ns = depth.stamp_ns - color.stamp_ns
        self.statistics.pairs += 1
        self.statistics.skews_ns.append(skew_ns)
        return Pair(color.item, depth.item, color.stamp_ns, skew_ns)

    def _miss(self, color: _Waiting[ItemT]) -> None:
        self._colors.remove(color)
        self.statistics.missed += 1
        gaps = [abs(stamp - color.stamp_ns) for stamp in self._depth_stamps]
        self.statistics.missed_gap_ns = min(gaps, default=None)
