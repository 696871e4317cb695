"""When the messages of a recording are played: at a rate, frame by frame, with a clock."""

from __future__ import annotations

import os
import select
import time
from dataclasses import dataclass

STDIN = 0


@dataclass(frozen=True, slots=True)
class Pace:
    """How a recording is played.

    Args:
        rate: Speed, 1 is as recorded.
        loop: Whether to play again and again until Ctrl-C.
        step: Whether to wait for the Enter key before each colour image.
        clock: Whether to publish the time of the recording on /clock.
    """

    rate: float = 1.0
    loop: bool = False
    step: bool = False
    clock: bool = False


class BagClock:
    """Time of a recording while it is played; it stands still before, between and after."""

    def __init__(self, rate: float) -> None:
        """Set the speed of the clock."""
        self._rate = rate
        self._at_ns: int | None = None
        self._since_s: float | None = None

    def go_on(self, time_ns: int) -> None:
        """Let it run, from where it stands, or from a time [ns] where it was never set."""
        if self._since_s is None:
            self._at_ns = time_ns if self._at_ns is None else self._at_ns
            self._since_s = time.monotonic()

    def pause(self) -> None:
        """Let it stand."""
        self._at_ns, self._since_s = self.now_ns(), None

    def rewind(self) -> None:
        """Forget the time, so that it starts anew."""
        self._at_ns = self._since_s = None

    def now_ns(self) -> int | None:
        """Return the time of the recording [ns], None where it was never set."""
        if self._at_ns is None or self._since_s is None:
            return self._at_ns
        return self._at_ns + round((time.monotonic() - self._since_s) * 1e9 * self._rate)

    def seconds_until(self, time_ns: int) -> float:
        """Return how long it takes until a time of the recording [ns], at the present speed."""
        now_ns = self.now_ns()
        return 0.0 if now_ns is None else (time_ns - now_ns) / 1e9 / self._rate


class EnterKey:
    """Lines on standard input; each lets one frame pass, and their end lets all pass."""

    def __init__(self, descriptor: int = STDIN) -> None:
        """Listen to a file."""
        self._descriptor = descriptor
        self._lines = 0
        self._has_ended = False

    def may_pass(self) -> bool:
        """Return whether the next frame may pass, without waiting."""
        while not self._has_ended and select.select([self._descriptor], [], [], 0)[0]:
            text = os.read(self._descriptor, 4096)
            self._lines += text.count(b'\n')
            self._has_ended = not text
        if self._lines:
            self._lines -= 1
            return True
        return self._has_ended
