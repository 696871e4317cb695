"""Looks for people: in the frame itself, or beside the following of those who are known.

A network takes as long as following a person through several frames. Given somebody who looks
meanwhile, the tracker goes on, and what was seen in one frame comes in with a later one, moved on
as far as those it belongs to have moved. Without, every frame waits for its look, so that results
do not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool

from pop_core.depth_noise import DepthNoise, estimate_depth_noise
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.rgbd import RgbdFrame
from pop_core.segmentation.ground import Ground, find_ground
from pop_core.stopwatch import Stopwatch
from pop_core.tracking.association import Expected, offset_m
from pop_core.tracking.finder import Finder, Found
from pop_core.tracking.late_belief import carried


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What was seen in a frame.

    Args:
        frame: The undistorted frame.
        found: The people in it.
        ground: The floor, if one is seen.
        noise: Noise of the measured depth.
        times_ms: Wall time per step [ms].
        places: Where those were who were known in that frame, by the number of their track; of
            none when it is the present one.
    """

    frame: RgbdFrame
    found: Found
    ground: Ground | None
    noise: DepthNoise
    times_ms: Mapping[str, float]
    places: Mapping[int, Expected] = field(default_factory=dict)

    def scene(self, taken: Bool[np.ndarray, 'h w'], track: int | None = None) -> Scene:
        """Return its frame, with the pixels that nearer people explain.

        Args:
            taken: Those pixels in the present frame: where people were, they are no more.
            track: Whose frame it is to be; None for somebody new, who is behind everybody.
        """
        place = None if track is None else self.places.get(track)
        if place is not None:
            taken = np.zeros_like(taken) if place.cover is None else place.cover
        elif self.places:
            taken = np.any([other.mask for other in self.places.values()], axis=0)
        return Scene(self.frame, self.ground, self.noise, taken)

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
        self, finder: Finder, taken: Bool[np.ndarray, 'h w'], track: int, expected: Expected
    ) -> LiftedJoints:
        """Return the person's joints where they should be by now.

        Args:
            finder: Lifts them anew where somebody nearer may have been in the way.
            taken: Pixels that nearer people explain in the present frame.
            track: Number of the track that they belong to.
            expected: Where the person should be by now.
        """
        look = self.look
        lifted = finder.lifted_behind(look.scene(taken, track), look.found, self.index)
        place = look.places.get(track)
        if place is None:
            return lifted
        return carried(lifted, place.points, expected.points, look.frame.camera)


def look_for_people(pipeline: BodyPipeline, frame: RgbdFrame, seen: RgbdFrame) -> Look:
    """Return what is seen in a frame.

    Args:
        pipeline: Knows the detector and its settings.
        frame: The frame as the camera gave it.
        seen: The same without distortion.

    Raises:
        PopError: If the keypoint source cannot read what it needs for this frame.
    """
    watch = Stopwatch()
    with watch.step('detect'):
        detections = pipeline.detector.detect(frame)
    with watch.step('lift'):
        found = Finder(pipeline).lift(
            seen, [undistort_detection(d, frame.camera) for d in detections])
    with watch.step('ground'):
        ground = find_ground(seen) if pipeline.config.use_ground else None
        noise = estimate_depth_noise(seen.depth_m)
    return Look(seen, found, ground, noise, watch.times_ms)


@runtime_checkable
class Lookout(Protocol):
    """Whoever looks meanwhile, one look after the other."""

    def submit(self, look: Callable[[], Look]) -> Future[Look]:
        """Begin a look."""
        ...


class Looks:
    """Has one look at a time made, and keeps it until the next frame."""

    def __init__(self, lookout: Lookout | None = None) -> None:
        """Have looks made meanwhile; None makes each while it is waited for."""
        self._lookout = lookout
        self._made: Future[Look] | None = None
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
        made = self._made
        if made is None or not made.done():
            return None
        places = self._places or {}
        self.forget()
        return replace(made.result(), places=places)

    def look(self, make: Callable[[], Look], *, wait: bool) -> Look | None:
        """Return a look at the present frame, or begin it if nobody has to wait.

        Args:
            make: Makes it.
            wait: Whether it is needed at once; one that is being made is forgotten then.
        """
        if self._lookout is None:
            return make()
        # The detector answers one question at a time.
        made = self._lookout.submit(make)
        self.forget()
        if wait:
            return made.result()
        self._made = made
        return None

    def remember(self, places: Callable[[], dict[int, Expected]]) -> None:
        """End a frame: keep where people were if it is the one that is looked at."""
        if self._made is not None and self._places is None:
            self._places = places()

    def forget(self) -> None:
        """Forget what is being made; it is finished, but nobody will hear of it."""
        self._made = self._places = None
