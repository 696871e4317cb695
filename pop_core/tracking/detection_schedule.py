"""When to look for people: rarely while all are followed well, often while somebody is not."""

from __future__ import annotations

from collections.abc import Sequence

from pop_core.estimate import TrackState
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracking_config import TrackingConfig

LATEST_S = 0.12  # slow cameras: people move far between frames
SOON = 2  # frames from one look to the next while somebody is not followed well


class DetectionSchedule:
    """Decides, frame by frame, whether to ask the detector."""

    def __init__(self, config: TrackingConfig) -> None:
        """Ask at the first frame."""
        self._config = config
        self._frames_since, self._last_ns = config.detect_every, 0

    def is_due(self, tracks: Sequence[PersonTrack], now_ns: int) -> bool:
        """Return whether to look for people in this frame; if so, it counts as done."""
        self._frames_since += 1
        every = self._config.detect_every
        if any(_needs_a_look(track) for track in tracks):
            every = min(every, SOON)
        late = (now_ns - self._last_ns) * 1e-9 > LATEST_S
        if tracks and not late and self._frames_since < every:
            return False
        self._frames_since, self._last_ns = 0, now_ns
        return True


def _needs_a_look(track: PersonTrack) -> bool:
    return track.is_doubtful or track.state is not TrackState.TRACKED
