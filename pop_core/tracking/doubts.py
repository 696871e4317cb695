"""When what is believed of a person is to be looked for anew, or to be given up."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool

from pop_core.body.joints import SHARED
from pop_core.estimate import JointState, TrackState
from pop_core.tracking.detection_schedule import Gap
from pop_core.tracking.fresh_fits import FreshFit
from pop_core.tracking.track import PersonTrack

STALE_S = 0.25  # unseen for longer, a person is looked for anew
# Who is followed well is looked for anew rarely, and ever more so while nothing better is found.
MOST_DOUBTS, RESTART_EVERY_S, RAREST_RESTART_S = 2, 1.0, 4.0
# A body that no look has agreed with yet is looked for anew soon, then ever more rarely [s].
FIRST_WAIT_S, LONGEST_WAIT_S = 0.05, 1.6
MOST_MISSES = 3
CREDIBLE_SCORE = 0.5  # of a body that somebody is taken to be who was expected elsewhere
CLEARLY_SEEN = 8  # shared joints that a body claims the camera sees: a detector would find it
SETTLED_S = 0.5  # after a body was found


def is_stale(track: PersonTrack) -> bool:
    """Return whether too much may have happened unseen for a prediction to be of use."""
    return track.unseen_s - track.gap_s > STALE_S


def is_doubtful(track: PersonTrack, gap: Gap) -> bool:
    """Return whether a prediction should be compared with a body found anew.

    Long gaps of our own making are no reason: they would only grow.
    """
    if gap.is_of_slow_camera:
        return True
    if track.tries > 0:
        wait_s = _doubled(FIRST_WAIT_S, track.tries - 1, LONGEST_WAIT_S)
        return track.doubts > 0 and _restarted_ago_s(track) > wait_s
    wait_s = _doubled(RESTART_EVERY_S, track.rivals_beaten, RAREST_RESTART_S)
    return track.doubts >= MOST_DOUBTS and _restarted_ago_s(track) > wait_s


def has_outgrown_evidence(track: PersonTrack, seen: Bool[np.ndarray, 's']) -> bool:
    """Return whether most joints that are seen now were not yet when the body was looked for.

    Of who came out from behind a wall with a leg first, trunk and head are a guess that the
    first keypoints agree with.

    Args:
        track: The person.
        seen: Shared joints that are surely seen.
    """
    known = track.evidence[seen]
    return bool(known.size and known.mean() < 0.5)


def may_be(track: PersonTrack, fresh: FreshFit) -> bool:
    """Return whether a body that was found elsewhere may be a person, and not what hides them.

    Of somebody who passes behind a wall the first or last keypoints lie on the wall; of somebody
    behind another person, on that person.
    """
    found = fresh.person.estimate
    if found is None or found.score < CREDIBLE_SCORE:
        return False
    # Who was not seen for a while may be at another distance, where depth errs otherwise.
    return is_stale(track) or not track.is_unusual(found.energies['E_depth'])


def is_settled(track: PersonTrack) -> bool:
    """Return whether the place of a person is sure, as far as keypoints tell."""
    return _restarted_ago_s(track) > SETTLED_S and track.doubts == 0 and track.misses == 0


def count_misses(track: PersonTrack, was_detected: bool) -> None:
    """Give up a body that no further look for people confirms: a new one, or one in full view."""
    track.misses = 0 if was_detected else track.misses + 1
    clear = (track.joint_state[SHARED] == JointState.VISIBLE).sum() >= CLEARLY_SEEN
    if track.misses >= MOST_MISSES and (clear or not track.is_proven):
        track.state = TrackState.LOST


def _doubled(first_s: float, times: int, longest_s: float) -> float:
    """Return a wait that doubles with every time, up to the longest."""
    return min(first_s * 2.0 ** min(times, 16), longest_s)


def _restarted_ago_s(track: PersonTrack) -> float:
    return (track.now_ns - track.restarted_ns) * 1e-9
