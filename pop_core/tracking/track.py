"""One person over time: what is believed of them, and the life of the track."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import N_JOINTS, N_SHARED
from pop_core.body.model import BodyParameters
from pop_core.estimate import BodyEstimate, JointState, Track, TrackState
from pop_core.tracking.body_filter import FilterState
from pop_core.tracking.limb_rest import LimbRests
from pop_core.tracking.tracking_config import TrackingConfig

UNUSUAL, UNUSUAL_M = 1.5, 0.01  # E_depth above this many times the usual and this much more


def _no_joints() -> Bool[np.ndarray, '15']:
    return np.zeros(N_SHARED, dtype=bool)


def _no_bones() -> Bool[np.ndarray, '24']:
    return np.zeros(N_JOINTS, dtype=bool)


@dataclass(slots=True, eq=False)
class Alternative:
    """Another explanation of a person, followed while the evidence cannot decide.

    Args:
        filter: What it believes.
        excess: Cost beyond the best explanation's, summed over the frames it was followed.
        born_ns: When it appeared.
    """

    filter: FilterState
    excess: float
    born_ns: int


@dataclass(slots=True, eq=False)
class PersonTrack:
    """A person of a sequence.

    Args:
        id: Number of the person.
        filter: The best explanation: body, velocities, covariances.
        born_ns: First frame with the person.
        now_ns: Frame that the belief is of.
        gap_s: Time from the frame before it [s].
        seen_ns: Last frame in which the camera saw any of the person.
        joint_seen_ns: The same per joint.
        mask: Pixels of the person in the last frame.
        joint_state: A JointState per joint of the last frame.
        hidden_at_look: Which joints the camera did not see when people were looked for last.
        trust: Plausibility at the last detection, 0..1.
        state: Where the track is in its life.
        hits: Frames in which the person was seen.
        misses: Looks for people, one after the other, that did not find a person who was seen.
        doubts: Detections, one after the other, after which something was still wrong.
        is_doubtful: Whether something was wrong in the last frame.
        misnamed: Shared joints whose left and right were exchanged at the last detection.
        unnamed: Joints of limbs that no keypoint confirmed at the last detection.
        is_proven: Whether a look after the first one has agreed with the body.
        tries: Bodies that were taken over since a look last agreed with one.
        rivals_beaten: Bodies found anew, one after the other, that were no better.
        restarted_ns: When the body was last looked for anew.
        evidence: Shared joints that were surely seen when it was.
        landmarks: Where the shared joints were in the last frame, None before the second [m].
        trail: Where the joints were of late, None before the second frame [m].
        left_m: How far any joint has left it.
        blur_m: Noise of the depth image where the person is.
        depth_level: E_depth that is usual for this person [m].
        alternatives: Other explanations.
        limb_rests: Limbs that were looked for in vain of late.
        shown: Parameters given out last.
    """

    id: int
    filter: FilterState
    born_ns: int
    now_ns: int
    seen_ns: int
    joint_seen_ns: Int[np.ndarray, '24']
    mask: Bool[np.ndarray, 'h w']
    joint_state: Int[np.ndarray, '24']
    hidden_at_look: Bool[np.ndarray, '24']
    trust: float
    gap_s: float = 0.0
    state: TrackState = TrackState.NEW
    hits: int = 1
    misses: int = 0
    doubts: int = 0
    is_doubtful: bool = False
    misnamed: Bool[np.ndarray, '15'] = field(default_factory=_no_joints)
    unnamed: Bool[np.ndarray, '24'] = field(default_factory=_no_bones)
    is_proven: bool = False
    tries: int = 1
    rivals_beaten: int = 0
    restarted_ns: int = 0
    evidence: Bool[np.ndarray, '15'] = field(default_factory=_no_joints)
    landmarks: Float[np.ndarray, '15 3'] | None = None
    trail: Float[np.ndarray, '24 3'] | None = None
    left_m: float = 0.0
    blur_m: float = 0.0
    depth_level: float | None = None
    alternatives: list[Alternative] = field(default_factory=list)
    limb_rests: LimbRests = field(default_factory=LimbRests)
    shown: BodyParameters | None = None

    @property
    def unseen_s(self) -> float:
        """Return for how long nothing of the person was seen [s]."""
        return (self.now_ns - self.seen_ns) * 1e-9

    @property
    def has_just_begun(self) -> bool:
        """Return whether one frame is all that is known of the person."""
        return self.hits == 1

    @property
    def is_shown(self) -> bool:
        """Return whether the person is given out."""
        return self.state is not TrackState.LOST

    def is_unusual(self, depth_m: float) -> bool:
        """Return whether an E_depth [m] is far above what is usual for this person."""
        usual_m = self.depth_level
        return usual_m is not None and depth_m > UNUSUAL * usual_m + UNUSUAL_M

    def note_seen(self, estimate: BodyEstimate, config: TrackingConfig) -> None:
        """Take over a frame that shows the person."""
        self.seen_ns = self.now_ns
        self.joint_seen_ns[estimate.joint_state == JointState.VISIBLE] = self.now_ns
        self.mask, self.joint_state = estimate.mask, estimate.joint_state
        self.hits += 1
        sure = self.hits >= config.confirm_frames
        self.state = TrackState.TRACKED if sure else TrackState.NEW

    def note_look(self) -> None:
        """Take over that people were looked for in the present frame."""
        self.hidden_at_look = self.joint_state != JointState.VISIBLE

    def note_unseen(self, hidden: bool, config: TrackingConfig) -> None:
        """Take over a frame that shows nothing of the person.

        Args:
            hidden: Whether something hides the person where they should be; else they left.
            config: How long a hidden person is given out.
        """
        self.mask = np.zeros_like(self.mask)
        self.misses = 0
        was_sure = self.state is not TrackState.NEW
        waits = hidden and was_sure and self.unseen_s <= config.predicted_s
        self.state = TrackState.PREDICTED if waits else TrackState.LOST

    def has_ended(self, config: TrackingConfig) -> bool:
        """Return whether the person will not get this id again."""
        never_sure = self.hits < config.confirm_frames or not self.is_proven
        return self.state is TrackState.LOST and (never_sure or self.unseen_s > config.lost_s)

    def tag(self) -> Track:
        """Return what users are told of the track."""
        return Track(
            id=self.id, state=self.state, age_s=(self.now_ns - self.born_ns) * 1e-9,
            unseen_s=self.unseen_s,
            joint_unseen_s=(self.now_ns - self.joint_seen_ns) * 1e-9)


def new_track(
    number: int, belief: FilterState, estimate: BodyEstimate, trust: float, now_ns: int
) -> PersonTrack:
    """Return the track of a person seen for the first time."""
    unseen = np.full(N_JOINTS, now_ns)
    return PersonTrack(
        id=number, filter=belief, born_ns=now_ns, now_ns=now_ns, seen_ns=now_ns,
        joint_seen_ns=unseen, mask=estimate.mask, joint_state=estimate.joint_state,
        hidden_at_look=estimate.joint_state != JointState.VISIBLE, trust=trust)
