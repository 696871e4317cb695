"""What is compared: every frame fitted alone with people followed by place, and the tracker."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float

from benchmarks.accuracy_methods import GivenDetections
from benchmarks.tracking_records import TrackTable, TruthRecorder, TruthTable, track_table
from pop_core.pipeline import BodyPipeline
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.sequence import SequenceFrame
from pop_core.tracking.tracker import BodyTracker
from pop_core.tracking.tracking_config import TrackingConfig
from pop_ros.person_ids import PersonIds


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """One body that a method gives out for a frame.

    Args:
        id: Number that the method gave the person.
        joints: Joints, camera frame [m].
        covariance: Their stated covariance [m^2].
    """

    id: int
    joints: Float[np.ndarray, '24 3']
    covariance: Float[np.ndarray, '24 3 3']


class SequenceMethod(Protocol):
    """Anything that follows people through frames given in order."""

    def __call__(self, frame: RgbdFrame) -> list[Sighting]:
        """Return the bodies of the next frame."""
        ...


class PerFrame:
    """Every frame alone; the nearest pelvis keeps the number."""

    def __init__(self, pipeline: BodyPipeline) -> None:
        """Take a prepared pipeline."""
        self._pipeline, self._ids = pipeline, PersonIds()

    def __call__(self, frame: RgbdFrame) -> list[Sighting]:
        """Return the bodies of the next frame."""
        bodies = self._pipeline.process(frame).bodies
        pelvis = np.array([body.joints[0] for body in bodies]).reshape(-1, 3)
        return [
            Sighting(number, body.joints, body.joint_covariance)
            for number, body in zip(self._ids.assign(pelvis), bodies, strict=True)]


class Tracked:
    """The tracker."""

    def __init__(self, pipeline: BodyPipeline, config: TrackingConfig) -> None:
        """Take a prepared pipeline and the tracker's settings."""
        self._tracker = BodyTracker(pipeline, config)

    def __call__(self, frame: RgbdFrame) -> list[Sighting]:
        """Return the bodies of the next frame."""
        return [
            Sighting(body.track.id, body.joints, body.joint_covariance)
            for body in self._tracker.process(frame).bodies if body.track is not None]


METHODS = ('per frame', 'tracked')


def make_methods(
    names: Sequence[str], pipeline: BodyPipeline, config: TrackingConfig
) -> dict[str, SequenceMethod]:
    """Return fresh methods, knowing nobody yet."""
    every: dict[str, SequenceMethod] = {
        'per frame': PerFrame(pipeline), 'tracked': Tracked(pipeline, config)}
    return {name: every[name] for name in names}


def follow(
    frames: Iterable[SequenceFrame], rate_hz: float, methods: dict[str, SequenceMethod],
    detector: GivenDetections, advance: Callable[[], None],
) -> tuple[TruthTable, dict[str, TrackTable]]:
    """Run all methods over a sequence, frame by frame so that they share the machine's moods.

    Args:
        frames: The sequence.
        rate_hz: Its frames per second.
        methods: Fresh ones by name.
        detector: Where every method looks for keypoints.
        advance: Called after every frame.
    """
    truth = TruthRecorder(rate_hz)
    rows: dict[str, list[tuple[int, int, np.ndarray, np.ndarray]]] = {m: [] for m in methods}
    wall_ms: dict[str, list[float]] = {m: [] for m in methods}
    cpu_ms: dict[str, list[float]] = {m: [] for m in methods}
    for number, frame in enumerate(frames):
        truth.add(frame)
        detector.people = [d for d in frame.detections if d is not None]
        for name, method in methods.items():
            wall, cpu = time.perf_counter(), time.process_time()
            found = method(frame.scene.frame)
            wall_ms[name].append(1e3 * (time.perf_counter() - wall))
            cpu_ms[name].append(1e3 * (time.process_time() - cpu))
            rows[name] += [(number, s.id, s.joints, s.covariance) for s in found]
        advance()
    return truth.table(), {
        name: track_table(rows[name], wall_ms[name], cpu_ms[name]) for name in methods}
