"""When to look for people: rarely while all are followed well, often while somebody is not."""

from __future__ import annotations

from collections.abc import Sequence

from pop_core.estimate import TrackState
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracking_config import TrackingConfig

LONG_GAP_S = 0.12  # between two frames: people move far, and there is time to look
SOON = 2  # frames from one look to the next while somebody is not followed well


class DetectionSchedule:
    """Decides, frame by frame, whether to ask the detector."""

    def __init__(self, config: TrackingConfig) -> None:
        """Ask at the first frame."""
        self._config = config
        self._frames_since, self._now_ns = config.detect_every, 0

    def is_due(self, tracks: Sequence[PersonTrack], now_ns: int) -> bool:
        """Return whether to look for people in this frame; if so, it counts as done."""
        self._frames_since += 1
        every = self._config.detect_every
        if any(_needs_a_look(track) for track in tracks):
            every = min(every, SOON)
        gap_s = (now_ns - self._now_ns) * 1e-9
        self._now_ns = now_ns
        if tracks and gap_s <= LONG_GAP_S and self._frames_since < every:
            return False
        self._frames_since = 0
        return True


def _needs_a_look(track: PersonTrack) -> bool:
    return track.is_doubtful or track.state is not TrackState.TRACKED
