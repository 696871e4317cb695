"""Lost limbs looked for in the frame itself, or beside the following.

A search takes as long as following the person through two frames. Given somebody who searches
meanwhile, the tracker goes on, and a limb that was found is put in its place some frames later,
turned against its parent as it was found. Without, every frame waits for its searches, so that
results do not depend on the machine.
"""

from __future__ import annotations

from collections.abc import Collection
from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.body.model import BodyParameters
from pop_core.fitting.body_fit import BodyFitter
from pop_core.fitting.observation import Observation
from pop_core.keypoints.lifted_joints import LiftedJoints
from pop_core.pipeline import BodyPipeline
from pop_core.tracking.background import Background
from pop_core.tracking.body_filter import FilterState
from pop_core.tracking.limb_recovery import LimbRecovery, LostLimbs
from pop_core.tracking.limb_rest import Tried
from pop_core.tracking.motion import SPEED
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import FollowedBody, SeenBody, WarmStart

LATE_RAD = 0.3  # how far a limb may have turned while it was looked for
LATEST_S = 0.5  # what was found longer ago is no longer there
# One after the other, each of which costs a frame; where no help is to be had, frames wait.
MOST_FAILURES = 3


@dataclass(frozen=True, slots=True, eq=False)
class LimbQuestion:
    """Lost limbs as another process is asked for them: without what it has itself.

    Args:
        belief: The belief that the body was fitted from.
        parameters: The fit.
        of_limb: Weight of the measured points that each limb claims.
        observation: What the sensor says.
        lifted: The person's joints, as they were detected.
        resting: Joints that are not looked for.
        config: How people are followed.
    """

    belief: FilterState
    parameters: BodyParameters
    of_limb: Float[np.ndarray, '4']
    observation: Observation
    lifted: LiftedJoints
    resting: Bool[np.ndarray, '24']
    config: TrackingConfig

    @classmethod
    def of(cls, lost: LostLimbs, config: TrackingConfig) -> LimbQuestion:
        """Return the question that lost limbs are looked for with."""
        body = lost.body
        return cls(lost.belief, body.state.parameters, body.of_limb, lost.observation,
                   lost.lifted, lost.resting, config)

    def lost(self, fitter: BodyFitter) -> LostLimbs:
        """Return the body that is asked for, as a fitter sees it."""
        start = SeenBody.look(fitter.coarse.state(self.parameters), self.observation)
        segment = fitter.steps.segment(start.visibility.rendered, self.observation)
        body = FollowedBody(start.state, start.visibility, segment, self.of_limb)
        return LostLimbs(self.belief, body, self.observation, self.lifted, self.resting)


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """A search that somebody asked for.

    Args:
        stamp_ns: Stamp of the frame.
        future: What will become of it.
    """

    stamp_ns: int
    future: Future[LimbAnswer]


@dataclass(frozen=True, slots=True, eq=False)
class LimbAnswer:
    """What became of the limbs that were looked for.

    Args:
        body_pose: Turns of the 23 joints, those of the limbs that were found among them [rad].
        tried: The limbs, and whether each was found.
    """

    body_pose: Float[np.ndarray, '23 3']
    tried: tuple[Tried, ...]


def find_limbs(pipeline: BodyPipeline, question: LimbQuestion) -> LimbAnswer:
    """Return what becomes of lost limbs; whoever works in the background calls this."""
    warm = WarmStart(pipeline.fitter, question.config.prior_weight)
    recovery = LimbRecovery(warm, question.config.steps).recover(question.lost(pipeline.fitter))
    fit = recovery.fit
    parameters = question.parameters if fit is None else fit.state.parameters
    return LimbAnswer(parameters.body_pose, recovery.tried)


def with_found_limbs(belief: FilterState, answer: LimbAnswer) -> FilterState:
    """Return a belief with the limbs that were found in an earlier frame."""
    found = np.zeros(len(belief.parameters.body_pose) + 1, dtype=bool)
    for limb, is_found in answer.tried:
        found |= limb & is_found
    pose = np.where(found[1:, None], answer.body_pose, belief.parameters.body_pose)
    turns = 3 + np.flatnonzero(np.repeat(found, 3))
    covariance = belief.covariance.copy()
    covariance[turns, turns] += LATE_RAD**2
    # The speeds were those of another place.
    velocity, mixed = belief.velocity.copy(), belief.mixed.copy()
    velocity_covariance = belief.velocity_covariance.copy()
    velocity[turns], mixed[:, turns] = 0.0, 0.0
    velocity_covariance[turns], velocity_covariance[:, turns] = 0.0, 0.0
    velocity_covariance[turns, turns] = SPEED[turns] ** 2
    return FilterState(
        belief.parameters.replaced(body_pose=pose), velocity, covariance, mixed,
        velocity_covariance)


class LateLimbs:
    """Has the lost limbs of each person looked for, one search of a person at a time."""

    def __init__(self, background: Background | None = None) -> None:
        """Have searches made meanwhile; None has everybody wait for them."""
        self._background = background
        self._asked: dict[int, Asked] = {}
        self._ready: dict[int, tuple[int, LimbAnswer]] = {}
        self._now_ns = 0
        self._has_time, self._failures = True, 0

    def begin(self, now_ns: int, *, has_time: bool) -> None:
        """Begin a frame with the answers that are ready for it: none becomes so within one.

        Args:
            now_ns: Its stamp.
            has_time: Whether there is time to wait for searches.

        Raises:
            Exception: Whatever ended a search; the next frame begins with the other answers.
        """
        self._now_ns, self._has_time = now_ns, has_time
        for track, asked in list(self._asked.items()):
            if asked.future.done():
                del self._asked[track]
                self._failures += 1
                self._ready[track] = asked.stamp_ns, asked.future.result()
                self._failures = 0

    @property
    def waits(self) -> bool:
        """Return whether limbs are to be looked for in the frame itself."""
        return (
            self._has_time or self._background is None or self._failures >= MOST_FAILURES)

    def ask(self, track: int, question: LimbQuestion) -> None:
        """Have the limbs of a track looked for, unless they already are."""
        if self._background is not None and track not in self._asked:
            future = self._background.submit(find_limbs, question)
            self._asked[track] = Asked(self._now_ns, future)

    def take(self, track: int) -> LimbAnswer | None:
        """Return what became of the limbs of a track, once."""
        stamp_ns, answer = self._ready.pop(track, (0, None))
        return answer if self._now_ns - stamp_ns <= LATEST_S * 1e9 else None

    def forget(self, track: int) -> None:
        """Forget a search: limbs were found otherwise, or the body has been replaced."""
        self._ready.pop(track, None)
        asked = self._asked.pop(track, None)
        if asked is not None:
            asked.future.cancel()

    def forget_unless(self, tracks: Collection[int]) -> None:
        """Forget the searches for those who are no longer followed."""
        for track in {*self._asked, *self._ready} - set(tracks):
            self.forget(track)
