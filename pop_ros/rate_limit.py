"""Let images through at a limited rate, decided by their stamps [ns] and not by a clock."""

from __future__ import annotations


class RateLimit:
    """Admits stamps so that their mean rate stays below a limit.

    A camera's period rarely divides the wanted one. What comes late does not delay the next, so
    that of a 30 Hz camera 20 Hz are let through where 20 Hz are allowed, and not 15.
    """

    def __init__(self) -> None:
        """Admit the first stamp, whatever it is."""
        self._due_ns: int | None = None

    def admit(self, stamp_ns: int, rate_hz: float) -> bool:
        """Return whether an image of this stamp [ns] is due at `rate_hz`; 0 admits all."""
        if rate_hz <= 0:
            self._due_ns = None
            return True
        period_ns = round(1e9 / rate_hz)
        early_ns = 0 if self._due_ns is None else self._due_ns - stamp_ns
        # More than a period early means that a clock or a bag has jumped back.
        if 0 < early_ns <= period_ns:
            return False
        # Half a period at least: a pause is not made up for by a burst.
        late_ns = min(max(-early_ns, 0), period_ns // 2)
        self._due_ns = stamp_ns + period_ns - late_ns
        return True
