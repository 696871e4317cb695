"""People of a sequence: who is who, found anew every few frames, followed in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import ThreadpoolController

from pop_core.depth_noise import USUAL_NOISE
from pop_core.errors import RepeatedStampError
from pop_core.estimate import BodyEstimate, EstimateStatus, FrameResult, TrackState
from pop_core.geometry.camera import Camera
from pop_core.pipeline import BodyPipeline, Scene
from pop_core.rgbd import RgbdFrame, distort_mask, undistort_frame
from pop_core.segmentation.ground import Ground
from pop_core.stopwatch import Stopwatch
from pop_core.tracking.association import Expected, associate, behind_others
from pop_core.tracking.background import Background
from pop_core.tracking.body_filter import first_state
from pop_core.tracking.detection_schedule import LONG_GAP_S, DetectionSchedule, Gap
from pop_core.tracking.doubles import doubles
from pop_core.tracking.doubts import (
    STALE_S,
    count_misses,
    has_outgrown_evidence,
    is_doubtful,
    is_settled,
    is_stale,
    may_be,
)
from pop_core.tracking.finder import Finder
from pop_core.tracking.follower import Follower
from pop_core.tracking.fresh_fits import FreshFit, FreshFits
from pop_core.tracking.late_limbs import LateLimbs
from pop_core.tracking.looks import Glimpse, Look, Looks
from pop_core.tracking.track import PersonTrack, new_track
from pop_core.tracking.tracking_config import TrackingConfig

ASTRAY_M = 0.3  # doubt of the place of somebody whom keypoints contradict
CALM_FRAMES = 30  # since one was left out: before, nothing is waited for
# Focal length and principal point that move by less are the same; by a larger share of the focal
# length, another camera's.
SAME_CAMERA_PX, REFOCUSED_SHARE = 0.5, 0.01
# No camera is as fast: what comes sooner came twice, or its stamp is no time in nanoseconds.
SHORTEST_GAP_NS = 1_000_000


class BodyTracker:
    """Follows every person from frame to frame; ids are never given to a second person."""

    def __init__(
        self, pipeline: BodyPipeline, config: TrackingConfig | None = None,
        finding: Background | None = None, lookout: Background | None = None,
        searching: Background | None = None,
    ) -> None:
        """Prepare to follow people with a pipeline's model, detector and settings.

        Given somebody who does that meanwhile, nobody waits but the person, as camera rate asks
        for; without, frames give the same bodies on any machine.

        Args:
            pipeline: Model, detector and settings.
            config: How people are followed.
            finding: Fits people from retrieved poses.
            lookout: Asks the detector.
            searching: Looks for lost limbs.
        """
        self._blas = ThreadpoolController()
        self._fresh, self._looks = FreshFits(finding), Looks(lookout)
        self._late_limbs = LateLimbs(searching)
        self._next_id = 0
        self._tracks: list[PersonTrack] = []
        self._gap, self._in_time = Gap(0.0), CALM_FRAMES
        self._last: tuple[Camera, int] | None = None
        self._ground: Ground | None = None
        self._noise = USUAL_NOISE
        self._refused: EstimateStatus | None = None
        self._is_empty = False  # whether the last look saw nobody
        self.configure(pipeline, config or TrackingConfig())

    def configure(self, pipeline: BodyPipeline, config: TrackingConfig) -> None:
        """Take over other settings, or a pipeline of the same body model; people stay known."""
        self.pipeline, self.config = pipeline, config
        self._follower = Follower(pipeline, config, self._late_limbs)
        self._finder = Finder(pipeline)
        self._schedule = DetectionSchedule(config)

    def reset(self) -> None:
        """Forget everybody and count ids from 0 again."""
        self.begin_anew()
        self._next_id = 0

    def process(self, frame: RgbdFrame, skipped: int = 0) -> FrameResult:
        """Return the people of the next frame, nearest first, each with their track.

        A jump back in time or another camera ends all tracks: what follows is another recording.
        A frame that is refused for its stamp changes nothing; one whose keypoints could not be
        read is over, and not to be tried again. The next one goes on after both.

        Args:
            frame: The frame.
            skipped: Frames of the camera since the last one that nobody had time for.

        Raises:
            RepeatedStampError: If the stamp is that of the frame before, or next to it.
            PopError: If the keypoint source cannot read what it needs for this frame, or could not
                for an earlier one that was looked at meanwhile.
        """
        watch = Stopwatch()
        frame = self._of_known_camera(frame)
        if self._is_another_recording(frame):
            self.begin_anew()
        self._check_stamp(frame)
        # What was left out before the first one was no lack of time.
        self._in_time = 0 if skipped and self._last is not None else self._in_time + 1
        self._gap = Gap(
            np.inf if self._last is None else (frame.stamp_ns - self._last[1]) * 1e-9, skipped,
            is_hurried=self._in_time < CALM_FRAMES)
        self._last = frame.camera, frame.stamp_ns
        self._late_limbs.begin(frame.stamp_ns, has_time=self._gap.has_time)
        with watch.step('undistort'):
            seen = undistort_frame(frame, colour=False)
        is_late, has_begun = self._fresh.poll(), False
        fresh = self._fresh.take(None)
        if fresh is not None:
            has_begun = self._welcome(fresh) is not None
            if not has_begun:
                # Who stands too far away, say, is no reason to look again at once.
                self._refused, is_late = fresh.person.status, False
        has_begun = has_begun or (
            self._gap.is_long and any(track.has_just_begun for track in self._tracks))
        with self._blas.limit(limits=1, user_api='blas'):
            look = self._look(
                frame, seen, watch, is_late=is_late or has_begun, has_begun=has_begun)
            bodies, statuses = self._track(seen, look, watch)
            self._looks.remember(self._places)
        bodies = [replace(b, mask=distort_mask(b.mask, frame.camera)) for b in bodies]
        bodies.sort(key=lambda body: float(body.joints[0, 2]))
        return FrameResult(tuple(bodies), tuple(statuses), watch.times_ms)

    def begin_anew(self) -> None:
        """Take what follows for another recording: nobody is known, and numbers go on."""
        self._tracks.clear()
        self._fresh.forget()
        self._looks.forget()
        self._late_limbs.forget_unless(())
        self._refused = None
        self._is_empty = False
        self._last, self._ground = None, None
        self._schedule = DetectionSchedule(self.config)

    def _of_known_camera(self, frame: RgbdFrame) -> RgbdFrame:
        """Return a frame with the camera of the last one, where it moved by less than matters.

        What is computed once per camera stays.
        """
        if self._last is None or not self._last[0].sees_like(frame.camera, SAME_CAMERA_PX):
            return frame
        return replace(frame, camera=self._last[0])

    def _is_another_recording(self, frame: RgbdFrame) -> bool:
        if self._last is None:
            return False
        camera, stamp_ns = self._last
        refocused_px = REFOCUSED_SHARE * camera.fx
        return frame.stamp_ns < stamp_ns or not camera.sees_like(frame.camera, refocused_px)

    def _check_stamp(self, frame: RgbdFrame) -> None:
        # One moment counted twice would be evidence that nobody moves.
        if self._last is None or frame.stamp_ns - self._last[1] >= SHORTEST_GAP_NS:
            return
        raise RepeatedStampError(
            f'tracker: expected a stamp at least {SHORTEST_GAP_NS} ns after that of the frame '
            f'before, {self._last[1]}, found {frame.stamp_ns}: the same frame again, or stamps '
            'that stand still or count no nanoseconds; frames without a clock can be fitted '
            'alone (BodyPipeline; tracking.enabled=false of node and replay)')

    def _look(
        self, frame: RgbdFrame, seen: RgbdFrame, watch: Stopwatch, *, is_late: bool,
        has_begun: bool,
    ) -> Look | None:
        """Return the people a detector sees, or None in frames that do without.

        Args:
            frame: The frame as the camera gave it.
            seen: The same without distortion.
            watch: Told how long it took.
            is_late: Whether a body comes in that was fitted to a frame of some time ago.
            has_begun: Whether it is somebody's first, who is elsewhere by now.
        """
        look = self._looks.take()
        is_needed = has_begun or not self._tracks
        patience_s = np.inf if is_needed else self._gap.patience_s
        if self._schedule.is_due(
                self._tracks, self._gap, is_busy=self._fresh.is_busy, is_late=is_late,
                is_looking=self._looks.is_busy and patience_s < np.inf,
                is_empty=self._is_empty):
            look = self._looks.look(self.pipeline, frame, seen, patience_s=patience_s) or look
        if look is None and self._looks.is_busy:
            # A body found anew is compared by keypoints too.
            self._fresh.put_off()
        if look is not None:
            watch.add(look.seen.times_ms)
            self._ground, self._noise = look.seen.ground, look.seen.noise
            self._is_empty = not look.found.detections
        return look

    def _places(self) -> dict[int, Expected]:
        places = behind_others([self._follower.expected(track) for track in self._tracks])
        return {track.id: place for track, place in zip(self._tracks, places, strict=True)}

    def _track(
        self, frame: RgbdFrame, look: Look | None, watch: Stopwatch
    ) -> tuple[list[BodyEstimate], list[EstimateStatus]]:
        """Follow everybody known, nearest first, then begin with whoever is new."""
        with watch.step('predict'):
            for track in self._tracks:
                self._follower.predict(track, frame.stamp_ns)
            expected = behind_others([self._expected(track) for track in self._tracks])
            matches = {} if look is None else self._matches(look, expected)
        scene = Scene(
            frame, self._ground, self._noise, np.zeros(frame.depth_m.shape, dtype=bool))
        bodies: list[BodyEstimate] = []
        nearer: BodyEstimate | None = None
        for row in np.argsort([t.filter.parameters.transl[2] for t in self._tracks]).tolist():
            scene = scene if nearer is None else self.pipeline.behind(scene, nearer)
            track, glimpse = self._tracks[row], matches.get(row)
            if look is not None:
                count_misses(track, glimpse is not None)
            nearer = self._continue(track, scene, glimpse, expected[row], watch)
            if self._schedule.has_looked:
                track.note_look()
            if nearer is not None:
                bodies.append(nearer)
        statuses = []
        if look is not None:
            statuses = [EstimateStatus.OK for _ in look.found.detections]
            for index in look.found.nearest_first({seen.index for seen in matches.values()}):
                scene = scene if nearer is None else self.pipeline.behind(scene, nearer)
                statuses[index], nearer = self._begin(scene, Glimpse(look, index), watch)
                if nearer is not None:
                    bodies.append(nearer)
        double = doubles(bodies)
        bodies = [body for body in bodies if body.track is None or body.track.id not in double]
        self._tracks = [
            t for t in self._tracks if t.id not in double and not t.has_ended(self.config)]
        known = {track.id for track in self._tracks}
        self._fresh.forget_unless(known)
        self._late_limbs.forget_unless(known)
        return bodies, statuses

    def _matches(self, look: Look, expected: Sequence[Expected]) -> dict[int, Glimpse]:
        """Return what a look saw of those who are followed."""
        people = zip(self._tracks, expected, strict=True)
        then = [look.then(track.id, place) for track, place in people]
        found = associate(then, look.found.detections, look.found.lifted, self.config.gate_m)
        return {row: Glimpse(look, index) for row, index in found.items()}

    def _expected(self, track: PersonTrack) -> Expected:
        """Return where a person should be; who was just found or is contradicted may be elsewhere.

        Of somebody who comes out from behind a wall the first look sees an arm.
        """
        expected = self._follower.expected(track)
        if is_settled(track):
            return expected
        return replace(expected, doubt_m=max(expected.doubt_m, ASTRAY_M))

    def _continue(
        self, track: PersonTrack, scene: Scene, glimpse: Glimpse | None, expected: Expected,
        watch: Stopwatch,
    ) -> BodyEstimate | None:
        """Return a known person in this frame, or None where nothing is given out."""
        lifted, elsewhere = None, is_stale(track)
        fresh = self._fresh.take(track.id)
        if glimpse is not None:
            lifted = glimpse.joints(self._finder, scene, track.id, expected)
            astray = glimpse.offset_m(track.id, expected) > self.config.gate_m
            elsewhere = elsewhere or astray
            is_open = elsewhere or is_doubtful(track, self._gap) or (
                has_outgrown_evidence(track, lifted.sure))
            late_s = self._late_s(track)
            if fresh is None and late_s == 0.0 and is_open:
                with watch.step('restart'):
                    self._ask(scene, glimpse, track.id)
                fresh = self._fresh.take(track.id)
                if elsewhere and self._fresh.is_busy:
                    late_s = max(track.unseen_s, STALE_S)
            if late_s > 0.0:
                self._follower.catch_up(track, lifted, late_s)
        rival = fresh if fresh is not None and fresh.person.body is not None else None
        if rival is not None and elsewhere and not may_be(track, rival):
            rival = lifted = None
        if rival is not None and elsewhere:
            self._follower.restart(track, rival, lifted)
        elif track.state is TrackState.LOST and lifted is None:
            return None
        with watch.step('follow'):
            return self._follower.follow(track, scene, lifted, None if elsewhere else rival)

    def _late_s(self, track: PersonTrack) -> float:
        """Return for how long a person has walked on unseen while the first fit was made [s]."""
        is_late = track.has_just_begun and track.gap_s > LONG_GAP_S
        return track.gap_s if is_late and not self._gap.has_time else 0.0

    def _ask(self, scene: Scene, glimpse: Glimpse, number: int | None = None) -> None:
        """Have a detected person fitted from retrieved poses; wait where nobody is known."""
        self._fresh.ask(
            self.pipeline, glimpse.look.scene(scene, number), glimpse.detection, number,
            wait=self._gap.has_time or not self._tracks)

    def _begin(
        self, scene: Scene, glimpse: Glimpse, watch: Stopwatch
    ) -> tuple[EstimateStatus, BodyEstimate | None]:
        """Begin the track of a person who was detected and is nobody known."""
        if len(self._tracks) >= self.pipeline.config.max_people:
            return EstimateStatus.TOO_MANY, None
        with watch.step('begin'):
            self._ask(scene, glimpse)
        fresh = self._fresh.take(None)
        if fresh is None:
            # Who was fitted in vain is the nearest again, and is told why.
            status, self._refused = self._refused or EstimateStatus.WAITING, None
            return status, None
        track = self._welcome(fresh)
        if track is None or fresh.person.estimate is None:
            return fresh.person.status, None
        return fresh.person.status, replace(fresh.person.estimate, track=track.tag())

    def _welcome(self, fresh: FreshFit) -> PersonTrack | None:
        """Return a new track of whoever was found, at the time of the frame that was fitted."""
        person = fresh.person
        if person.estimate is None or person.body is None:
            return None
        track = new_track(
            self._next_id, first_state(person.body.parameters, person.body.hessian),
            person.estimate, person.estimate.score, fresh.stamp_ns)
        self._next_id += 1
        self._follower.begin(track, person.body)
        self._tracks.append(track)
        return track
