"""People of a sequence: who is who, found anew every few frames, followed in between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from threadpoolctl import ThreadpoolController

from pop_core.body.joints import SHARED
from pop_core.depth_noise import USUAL_NOISE, estimate_depth_noise
from pop_core.estimate import (
    BodyEstimate,
    EstimateStatus,
    FrameResult,
    JointState,
    TrackState,
)
from pop_core.geometry.camera import Camera
from pop_core.keypoints.undistortion import undistort_detection
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.rgbd import RgbdFrame, distort_mask, undistort_frame
from pop_core.segmentation.ground import Ground, find_ground
from pop_core.stopwatch import Stopwatch
from pop_core.tracking.association import Expected, associate, offset_m
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.detection_schedule import LONG_GAP_S, DetectionSchedule
from pop_core.tracking.finder import Finder, Found
from pop_core.tracking.follower import Follower
from pop_core.tracking.track import PersonTrack, new_track
from pop_core.tracking.tracking_config import TrackingConfig

STALE_S = 0.25  # unseen for longer, a person is looked for anew
MOST_DOUBTS, RESTART_EVERY_S = 2, 1.0
MOST_MISSES = 3
CLEARLY_SEEN = 8  # shared joints that a body claims the camera sees: a detector would find it
SETTLED_S = 0.5  # after a body was found
ASTRAY_M = 0.3  # doubt of the place of somebody whom keypoints contradict


class BodyTracker:
    """Follows every person from frame to frame; ids are never given to a second person."""

    def __init__(self, pipeline: BodyPipeline, config: TrackingConfig | None = None) -> None:
        """Prepare to follow people with a pipeline's model, detector and settings."""
        self._blas = ThreadpoolController()
        self._next_id = 0
        self._tracks: list[PersonTrack] = []
        self._last: tuple[Camera, int] | None = None
        self._ground: Ground | None = None
        self._noise = USUAL_NOISE
        self.configure(pipeline, config or TrackingConfig())

    def configure(self, pipeline: BodyPipeline, config: TrackingConfig) -> None:
        """Take over other settings, or a pipeline of the same body model; people stay known."""
        self.pipeline, self.config = pipeline, config
        self._follower, self._finder = Follower(pipeline, config), Finder(pipeline)
        self._schedule = DetectionSchedule(config)

    def reset(self) -> None:
        """Forget everybody and count ids from 0 again."""
        self._forget()
        self._next_id = 0

    def process(self, frame: RgbdFrame) -> FrameResult:
        """Return the people of the next frame, nearest first, each with their track.

        A jump back in time or another camera ends all tracks: what follows is another recording.

        Raises:
            PopError: If the keypoint source cannot read what it needs for this frame.
        """
        watch = Stopwatch()
        if self._is_another_recording(frame):
            self._forget()
        self._last = frame.camera, frame.stamp_ns
        with watch.step('undistort'):
            seen = undistort_frame(frame)
        found = self._look(frame, seen, watch)
        with self._blas.limit(limits=1, user_api='blas'):
            bodies, statuses = self._track(seen, found, watch)
        bodies = [replace(b, mask=distort_mask(b.mask, frame.camera)) for b in bodies]
        bodies.sort(key=lambda body: float(body.joints[0, 2]))
        return FrameResult(tuple(bodies), tuple(statuses), watch.times_ms)

    def _forget(self) -> None:
        self._tracks.clear()
        self._last, self._ground = None, None
        self._schedule = DetectionSchedule(self.config)

    def _is_another_recording(self, frame: RgbdFrame) -> bool:
        if self._last is None:
            return False
        camera, stamp_ns = self._last
        return frame.stamp_ns < stamp_ns or not same_camera(camera, frame.camera)

    def _look(
        self, frame: RgbdFrame, seen: RgbdFrame, watch: Stopwatch
    ) -> Found | None:
        """Return the people a detector sees, or None in frames that do without."""
        if not self._schedule.is_due(self._tracks, frame.stamp_ns):
            return None
        with watch.step('detect'):
            detections = self.pipeline.detector.detect(frame)
        with watch.step('lift'):
            found = self._finder.lift(
                seen, [undistort_detection(d, frame.camera) for d in detections])
        with watch.step('ground'):
            self._ground = find_ground(seen) if self.pipeline.config.use_ground else None
            self._noise = estimate_depth_noise(seen.depth_m)
        return found

    def _track(
        self, frame: RgbdFrame, looked: Found | None, watch: Stopwatch
    ) -> tuple[list[BodyEstimate], list[EstimateStatus]]:
        """Follow everybody known, nearest first, then begin with whoever is new."""
        found = Found() if looked is None else looked
        with watch.step('predict'):
            for track in self._tracks:
                self._follower.predict(track, frame.stamp_ns)
            expected = [self._expected(track) for track in self._tracks]
            matches = associate(
                expected, found.detections, found.lifted, self.config.gate_m)
        scene = Scene(
            frame, self._ground, self._noise, np.zeros(frame.depth_m.shape, dtype=bool))
        bodies: list[BodyEstimate] = []
        for row in np.argsort([t.filter.parameters.transl[2] for t in self._tracks]).tolist():
            track, index = self._tracks[row], matches.get(row)
            if looked is not None:
                _count_misses(track, index is not None)
            astray = index is not None and offset_m(
                expected[row], found.lifted[index]) > self.config.gate_m
            estimate = self._continue(track, scene, found, index, watch, astray=astray)
            if estimate is not None:
                bodies.append(estimate)
                scene = replace(scene, taken=scene.taken | estimate.mask)
        statuses = [EstimateStatus.OK for _ in found.detections]
        for index in found.nearest_first(set(matches.values())):
            statuses[index], estimate = self._begin(scene, found, index, watch)
            if estimate is not None:
                bodies.append(estimate)
                scene = replace(scene, taken=scene.taken | estimate.mask)
        self._tracks = [t for t in self._tracks if not t.has_ended(self.config)]
        return bodies, statuses

    def _expected(self, track: PersonTrack) -> Expected:
        """Return where a person should be; who was just found or is contradicted may be elsewhere.

        Of somebody who comes out from behind a wall the first look sees an arm.
        """
        expected = self._follower.expected(track)
        settled = (track.now_ns - track.restarted_ns) * 1e-9 > SETTLED_S
        if settled and track.doubts == 0 and track.misses == 0:
            return expected
        return replace(expected, doubt_m=max(expected.doubt_m, ASTRAY_M))

    def _continue(
        self, track: PersonTrack, scene: Scene, found: Found, index: int | None,
        watch: Stopwatch, *, astray: bool,
    ) -> BodyEstimate | None:
        """Return a known person in this frame, or None where nothing is given out."""
        lifted, rival = None, None
        if index is not None:
            lifted = self._finder.lifted_behind(scene, found, index)
            elsewhere = astray or _is_stale(track)
            if elsewhere or _is_doubtful(track):
                with watch.step('restart'):
                    person = self._finder.fit(scene, found, index)
                if elsewhere and person.fit is not None:
                    self._follower.restart(track, person)
                else:
                    rival = person.fit
        if track.state is TrackState.LOST and lifted is None:
            return None
        with watch.step('follow'):
            return self._follower.follow(track, scene, lifted, rival)

    def _begin(
        self, scene: Scene, found: Found, index: int, watch: Stopwatch
    ) -> tuple[EstimateStatus, BodyEstimate | None]:
        """Begin the track of a person who was detected and is nobody known."""
        if len(self._tracks) >= self.pipeline.config.max_people:
            return EstimateStatus.OK, None
        with watch.step('begin'):
            person = self._finder.fit(scene, found, index)
        if person.estimate is None or person.fit is None:
            return person.status, None
        track = new_track(
            self._next_id, first_state(person.fit.parameters, person.fit.hessian),
            person.estimate, person.estimate.score, scene.frame.stamp_ns)
        self._next_id += 1
        self._follower.begin(track, person)
        self._tracks.append(track)
        return person.status, replace(person.estimate, track=track.tag())


def same_camera(camera: Camera, other: Camera) -> bool:
    """Return whether two cameras see the same points at the same pixels."""
    size = (camera.width, camera.height, camera.distortion_model)
    return (
        size == (other.width, other.height, other.distortion_model)
        and np.array_equal(camera.K, other.K) and np.array_equal(camera.d, other.d))


def _is_stale(track: PersonTrack) -> bool:
    """Return whether too much may have happened unseen for a prediction to be of use."""
    return track.unseen_s - track.gap_s > STALE_S


def _is_doubtful(track: PersonTrack) -> bool:
    """Return whether a prediction should be compared with a body found anew."""
    if track.gap_s > LONG_GAP_S:
        return True
    since_s = (track.now_ns - track.restarted_ns) * 1e-9
    return track.doubts >= MOST_DOUBTS and since_s > RESTART_EVERY_S


def _count_misses(track: PersonTrack, was_detected: bool) -> None:
    """Give up a body that no further look for people confirms: a new one, or one in full view."""
    track.misses = 0 if was_detected else track.misses + 1
    clear = (track.joint_state[SHARED] == JointState.VISIBLE).sum() >= CLEARLY_SEEN
    if track.misses >= MOST_MISSES and (track.state is TrackState.NEW or clear):
        track.state = TrackState.LOST
