"""When to look for people: rarely while all are followed well, often while somebody is not.

Where nobody was seen, rarely too: an empty room leaves a robot its processor.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from pop_core.body.joints import SHARED
from pop_core.estimate import JointState, TrackState
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracking_config import TrackingConfig

LONG_GAP_S = 0.12  # between two frames of a camera: people move far, and there is time to look
# Noise of depth as wide as a limb is thick does not tell where one moves to.
BLURRED_M, MOVING_M = 0.028, 0.05
MOST_TRIES = 3  # whom looks go on contradicting is no news any more
SOON = 2  # frames from one look to the next while somebody is not followed well
# Frames are counted as of such a camera: at a lower rate people move farther from one to the next.
RATE_HZ = 30.0
# A camera that is slower leaves time to wait for a look, for this share of what lies between two
# of its frames: whoever is followed is drawn to where their limbs are, not to where they were.
WAITING_S, WAITING_SHARE = 0.058, 1.0 / 3.0  # 17 Hz: no usual rate is near it
LONGEST_S = 1000.0  # that is counted: before the first frame lies an eternity


@dataclass(frozen=True, slots=True)
class Gap:
    """What lies between a frame and the one before it.

    Args:
        duration_s: Time between their stamps [s].
        skipped: Frames of the camera in between that were left out for lack of time.
        is_hurried: Whether any were left out lately.
    """

    duration_s: float
    skipped: int = 0
    is_hurried: bool = False

    @property
    def is_long(self) -> bool:
        """Return whether people move far in it."""
        return self.duration_s > LONG_GAP_S

    @property
    def of_camera_s(self) -> float:
        """Return the time from one frame of the camera to the next [s]."""
        return self.duration_s / (self.skipped + 1)

    @property
    def is_of_slow_camera(self) -> bool:
        """Return whether it is the camera that leaves people unseen, and not we."""
        return self.of_camera_s > LONG_GAP_S

    @property
    def has_time(self) -> bool:
        """Return whether a frame may wait for a fit: of a slow camera, that is slow enough."""
        return self.is_of_slow_camera and not self.is_hurried

    @property
    def patience_s(self) -> float:
        """Return for how long a frame may wait for what is made beside the following [s].

        Whoever had to leave frames out has no time to wait.
        """
        if self.has_time:
            return math.inf
        if self.skipped > 0 or self.of_camera_s < WAITING_S:
            return 0.0
        return WAITING_SHARE * self.of_camera_s


class DetectionSchedule:
    """Decides, frame by frame, whether to ask the detector."""

    def __init__(self, config: TrackingConfig) -> None:
        """Ask at the first frame."""
        self._config = config
        self._frames_since, self._since_s = config.detect_every, config.detect_every / RATE_HZ

    @property
    def has_looked(self) -> bool:
        """Return whether the present frame is looked at, now or meanwhile."""
        return self._frames_since == 0

    def is_due(
        self, tracks: Sequence[PersonTrack], gap: Gap, *, is_busy: bool = False,
        is_late: bool = False, is_looking: bool = False, is_empty: bool = False,
    ) -> bool:
        """Return whether to look for people in this frame; if so, it counts as done.

        Args:
            tracks: Who is followed.
            gap: Time since the last frame.
            is_busy: Whether somebody is being fitted, so that nobody else can begin.
            is_late: Whether a body comes in that was fitted to a frame of some time ago.
            is_looking: Whether a look at an earlier frame is still being made.
            is_empty: Whether the last look saw nobody.
        """
        self._frames_since += 1
        self._since_s += gap.of_camera_s
        if is_looking or (not tracks and is_busy and not is_late):
            return False
        every = self._config.detect_every
        if any(_needs_a_look(track) for track in tracks):
            every = min(every, SOON)
        if any(_is_unproven(track) or _has_come_out(track) for track in tracks):
            every = 1
        # A look of our own that took long is no reason for the next.
        after_gap = gap.is_long and (gap.is_of_slow_camera or self._frames_since > 1)
        frames = round(min(self._since_s, LONGEST_S) * RATE_HZ)
        is_calm = bool(tracks) or is_empty
        if is_calm and not (is_late or after_gap) and frames < every:
            return False
        self._frames_since, self._since_s = 0, 0.0
        return True


def _has_come_out(track: PersonTrack) -> bool:
    """Return whether a joint is seen that was hidden when people were looked for last.

    Surfaces carry a limb on, but do not tell where it comes out from behind something.
    """
    seen = track.joint_state == JointState.VISIBLE
    return bool((seen & track.hidden_at_look)[SHARED].any())


def _is_unproven(track: PersonTrack) -> bool:
    """Return whether no look has agreed with a body yet that was found a moment ago."""
    return track.is_shown and 0 < track.tries <= MOST_TRIES


def _needs_a_look(track: PersonTrack) -> bool:
    is_blurred = track.blur_m > BLURRED_M and track.left_m > MOVING_M
    return is_blurred or track.is_doubtful or track.state is not TrackState.TRACKED
