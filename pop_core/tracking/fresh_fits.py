"""Bodies fitted from retrieved poses for a tracker: at once, or while it follows the others.

Such a fit takes as long as ten tracked frames. Given somebody who makes it meanwhile, one at a
time, the tracker goes on, and moves what was found on to the frame in which it is ready. Without,
every frame waits for its fits, so that results do not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Collection
from concurrent.futures import Future
from dataclasses import dataclass

from pop_core.keypoints.detection import Detection
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.tracking.background import Background
from pop_core.tracking.finder import FoundPerson, find_person


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
    future: Future[FoundPerson]
    is_ready: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class FreshFit:
    """A person fitted as if their frame stood alone.

    Args:
        person: Who was found.
        stamp_ns: Stamp of the frame.
    """

    person: FoundPerson
    stamp_ns: int


class FreshFits:
    """Has one fit at a time made, and keeps it until it is called for."""

    def __init__(self, background: Background | None = None) -> None:
        """Have fits made meanwhile; None makes each while it is asked for."""
        self._background = background
        self._asked: Asked | None = None
        self._has_failed = False

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

    def put_off(self) -> None:
        """Leave a fit that is ready to the next frame."""
        if self._asked is not None:
            self._asked.is_ready = False

    def ask(
        self, pipeline: BodyPipeline, scene: Scene, detection: Detection, track: int | None, *,
        wait: bool,
    ) -> None:
        """Have a person fitted, unless another fit is being made.

        After a fit that an error ended the next one is made here: nobody is lost for want of help.

        Args:
            pipeline: Makes the fit where it is waited for.
            scene: The frame.
            detection: The person in it.
            track: Number of the person's track; None for somebody new.
            wait: Whether to have it at once, since nobody is kept waiting.
        """
        if self.is_busy:
            return
        stamp_ns = scene.frame.stamp_ns
        if wait or self._background is None or self._has_failed:
            self._has_failed = False
            future: Future[FoundPerson] = Future()
            future.set_result(find_person(pipeline, scene, detection))
            self._asked = Asked(track, stamp_ns, future, is_ready=True)
        else:
            future = self._background.submit(find_person, scene, detection)
            self._asked = Asked(track, stamp_ns, future)

    def take(self, track: int | None) -> FreshFit | None:
        """Return the fit of a track, or of somebody new, once it is ready.

        Raises:
            Exception: Whatever ended the fit.
        """
        asked = self._asked
        if asked is None or asked.track != track or not asked.is_ready:
            return None
        self._asked = None
        self._has_failed = asked.future.exception() is not None
        return FreshFit(asked.future.result(), asked.stamp_ns)

    def forget_unless(self, tracks: Collection[int]) -> None:
        """Forget a fit that was made for a track which has ended."""
        if self._asked is not None and self._asked.track not in (None, *tracks):
            self.forget()

    def forget(self) -> None:
        """Forget what is being made; it is finished, but nobody will hear of it."""
        self._asked = None
