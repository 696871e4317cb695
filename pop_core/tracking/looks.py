"""Looks for people: in the frame itself, or beside the following of those who are known.

A network takes as long as following a person through several frames. Given somebody who looks
meanwhile, the tracker goes on, and what was seen in one frame comes in with a later one, moved on
as far as those it belongs to have moved; where the camera leaves time, a frame waits a little for
its own look. Without, every frame waits for it, so that results do not depend on the machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np

from pop_core.config import PipelineConfig
from pop_core.depth_noise import DepthNoise, estimate_depth_noise
from pop_core.keypoints.detection import Detection, KeypointDetector
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.pipeline import Scene
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.ground import Ground, find_ground
from pop_core.stopwatch import Stopwatch
from pop_core.tracking.association import Expected, offset_m
from pop_core.tracking.background import Background
from pop_core.tracking.finder import Finder, Found, found_people
from pop_core.tracking.late_belief import carried


@runtime_checkable
class Watcher(Protocol):
    """What a look needs of a pipeline: a keypoint source and its settings."""

    @property
    def detector(self) -> KeypointDetector:
        """Return the keypoint source."""
        ...

    @property
    def config(self) -> PipelineConfig:
        """Return the settings."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """What was seen in a frame.

    Args:
        found: The people in it.
        ground: The floor, if one is seen.
        noise: Noise of the measured depth.
        times_ms: Wall time per step [ms].
    """

    found: Found
    ground: Ground | None
    noise: DepthNoise
    times_ms: Mapping[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A frame and what was seen in it.

    Args:
        frame: The undistorted frame.
        seen: What was seen.
        places: Where those were who were known in that frame, by the number of their track; of
            none when it is the present one.
    """

    frame: RgbdFrame
    seen: Seen
    places: Mapping[int, Expected] = field(default_factory=dict)

    @property
    def found(self) -> Found:
        """Return the people who were seen."""
        return self.seen.found

    def scene(self, present: Scene, track: int | None = None) -> Scene:
        """Return its frame, with the pixels that nearer people explain.

        Args:
            present: The present frame, with what nearer people hide there; of an earlier frame
                only their pixels are known.
            track: Whose frame it is to be; None for somebody new, who is behind everybody.
        """
        if self.frame.stamp_ns == present.frame.stamp_ns:
            return replace(present, ground=self.seen.ground, noise=self.seen.noise)
        taken = present.taken
        place = None if track is None else self.places.get(track)
        if place is not None:
            taken = np.zeros_like(taken) if place.cover is None else place.cover
        elif self.places:
            taken = np.any([other.mask for other in self.places.values()], axis=0)
        return Scene(self.frame, self.seen.ground, self.seen.noise, taken)

    def then(self, track: int, expected: Expected) -> Expected:
        """Return where a person was in this frame, who should be somewhere by now."""
        place = self.places.get(track)
        if place is None:
            return expected
        return replace(expected, points=place.points, mask=place.mask, cover=place.cover)


@dataclass(frozen=True, slots=True, eq=False)
class Glimpse:
    """One person of a look.

    Args:
        look: What was seen.
        index: Which detection.
    """

    look: Look
    index: int

    @property
    def detection(self) -> Detection:
        """Return the keypoints."""
        return self.look.found.detections[self.index]

    def offset_m(self, track: int, expected: Expected) -> float:
        """Return how far the person was from where a track was thought to be [m]."""
        return offset_m(self.look.then(track, expected), self.look.found.lifted[self.index])

    def joints(
        self, finder: Finder, present: Scene, track: int, expected: Expected
    ) -> LiftedJoints:
        """Return the person's joints where they should be by now.

        Args:
            finder: Lifts them anew where somebody nearer may have been in the way.
            present: The present frame, with what nearer people hide there.
            track: Number of the track that they belong to.
            expected: Where the person should be by now.
        """
        look = self.look
        lifted = finder.lifted_behind(look.scene(present, track), look.found, self.index)
        place = look.places.get(track)
        if place is None:
            return lifted
        return carried(lifted, place.points, expected.points, look.frame.camera)


def look_for_people(watcher: Watcher, frame: RgbdFrame, undistorted: RgbdFrame) -> Seen:
    """Return what is seen in a frame.

    Args:
        watcher: Knows the detector and the settings.
        frame: The frame as the camera gave it.
        undistorted: The same without distortion.

    Raises:
        PopError: If the keypoint source cannot read what it needs for this frame.
    """
    watch = Stopwatch()
    with watch.step('detect'):
        detections = watcher.detector.detect(frame)
    with watch.step('lift'):
        found = found_people(
            undistorted, [undistort_detection(d, frame.camera) for d in detections],
            watcher.config.lifting)
    with watch.step('ground'):
        ground = find_ground(undistorted) if watcher.config.use_ground else None
        noise = estimate_depth_noise(undistorted.depth_m, undistorted.camera.fx)
    return Seen(found, ground, noise, watch.times_ms)


class Looks:
    """Has one look at a time made, and keeps it until the next frame."""

    def __init__(self, lookout: Background | None = None) -> None:
        """Have looks made meanwhile; None makes each while it is waited for."""
        self._lookout = lookout
        self._made: Future[Seen] | None = None
        self._frame: RgbdFrame | None = None
        self._places: dict[int, Expected] | None = None

    @property
    def is_busy(self) -> bool:
        """Return whether a look is being made."""
        return self._made is not None

    def take(self) -> Look | None:
        """Return a look at an earlier frame once it is ready.

        Raises:
            Exception: Whatever ended it.
        """
        made, frame, places = self._made, self._frame, self._places
        if made is None or frame is None or not made.done():
            return None
        self.forget()
        return Look(frame, made.result(), places or {})

    def look(
        self, watcher: Watcher, frame: RgbdFrame, undistorted: RgbdFrame, *, patience_s: float
    ) -> Look | None:
        """Return a look at the present frame, or None while it is still being made.

        Args:
            watcher: Looks where nobody does meanwhile.
            frame: The frame as the camera gave it.
            undistorted: The same without distortion.
            patience_s: For how long to wait for it; an earlier one is forgotten.
        """
        if self._lookout is None:
            return Look(undistorted, look_for_people(watcher, frame, undistorted))
        # The detector answers one question at a time.
        made = self._lookout.submit(look_for_people, frame, undistorted)
        self.forget()
        wait([made], None if patience_s == math.inf else patience_s)
        if made.done():
            return Look(undistorted, made.result())
        self._made, self._frame = made, undistorted
        return None

    def remember(self, places: Callable[[], dict[int, Expected]]) -> None:
        """End a frame: keep where people were if it is the one that is looked at."""
        if self._made is not None and self._places is None:
            self._places = places()

    def forget(self) -> None:
        """Forget what is being made; it is finished, but nobody will hear of it."""
        self._made = self._frame = self._places = None
