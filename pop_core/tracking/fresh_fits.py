"""Bodies fitted from retrieved poses for a tracker: at once, or while it follows the others.

Such a fit takes as long as ten tracked frames. Given an executor it runs beside them, one at a
time, and what it found is moved on to the frame in which it is ready. Without one, the default,
every frame waits for its fits, so that results do not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Executor, Future
from dataclasses import dataclass

from pop_core.pipeline import PersonFit


@dataclass(slots=True, eq=False)
class Asked:
    """A fit that somebody asked for.

    Args:
        track: Number of the person's track; None for somebody new.
        stamp_ns: Stamp of the frame that is fitted.
        future: What will become of it.
        is_ready: Whether it was done when the present frame began.
    """

    track: int | None
    stamp_ns: int
    future: Future[PersonFit]
    is_ready: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class FreshFit:
    """A person fitted as if their frame stood alone.

    Args:
        person: What became of the fit.
        stamp_ns: Stamp of the frame.
    """

    person: PersonFit
    stamp_ns: int


class FreshFits:
    """Has one fit at a time made, and keeps it until it is called for."""

    def __init__(self, executor: Executor | None = None) -> None:
        """Have fits made by an executor; None makes each while it is asked for."""
        self._executor = executor
        self._asked: Asked | None = None

    @property
    def is_busy(self) -> bool:
        """Return whether a fit is being made, or has not been called for yet."""
        return self._asked is not None

    def poll(self) -> bool:
        """Begin a frame; return whether a fit is ready for it: none becomes so within one."""
        if self._asked is None:
            return False
        self._asked.is_ready = self._asked.future.done()
        return self._asked.is_ready

    def ask(
        self, fit: Callable[[], PersonFit], track: int | None, stamp_ns: int, *, wait: bool
    ) -> None:
        """Have a person fitted, unless another fit is being made.

        Args:
            fit: Fits the person.
            track: Number of the person's track; None for somebody new.
            stamp_ns: Stamp of the frame that is fitted.
            wait: Whether to have it at once, since nobody is kept waiting.
        """
        if not self.is_busy:
            self._asked = (
                Asked(track, stamp_ns, _done(fit()), is_ready=True)
                if wait or self._executor is None
                else Asked(track, stamp_ns, self._executor.submit(fit)))

    def take(self, track: int | None) -> FreshFit | None:
        """Return the fit of a track, or of somebody new, once it is ready.

        Raises:
            Exception: Whatever ended the fit.
        """
        asked = self._asked
        if asked is None or asked.track != track or not asked.is_ready:
            return None
        self._asked = None
        return FreshFit(asked.future.result(), asked.stamp_ns)

    def forget_unless(self, tracks: Collection[int]) -> None:
        """Forget a fit that was made for a track which has ended."""
        if self._asked is not None and self._asked.track not in (None, *tracks):
            self.forget()

    def forget(self) -> None:
        """Forget what is being made; it is finished, but nobody will hear of it."""
        self._asked = None


def _done(person: PersonFit) -> Future[PersonFit]:
    future: Future[PersonFit] = Future()
    future.set_result(person)
    return future
