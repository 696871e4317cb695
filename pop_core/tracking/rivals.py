"""Explanations of one person that compete: which is best, and which are still worth following."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from pop_core.fitting.body_fit import BodyFitter
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.energy import PriorBelief
from pop_core.fitting.hypotheses import Hypothesis
from pop_core.fitting.limb_exchange import exchange_limbs
from pop_core.fitting.observation import Observation
from pop_core.tracking.detection_schedule import LONG_GAP_S
from pop_core.tracking.limbs import loosened
from pop_core.tracking.track import PersonTrack
from pop_core.tracking.tracking_config import TrackingConfig
from pop_core.tracking.warm_start import FollowedBody, WarmFit, WarmStart, updated

SAME_M = 0.04  # explanations nearer to each other than this, mean over joints, are one
DECIDED = 40.0  # summed cost that decides between two of them
BETTER = 8.0  # summed cost by which another must be better to take over
MUCH_BETTER = 15.0  # the same in a single frame, for who was followed well
LARGEST = 10.0  # of one frame: no single frame decides


def costs(
    fitter: BodyFitter, fits: Sequence[FollowedBody], observation: Observation
) -> list[float]:
    """Return the cost of each fit by E_depth, keypoints and priors, on common pixels."""
    return costs_over(
        fitter, [fit.state for fit in fits], observation, common_segment(fits))


def common_segment(fits: Sequence[FollowedBody]) -> Bool[np.ndarray, 'h w']:
    """Return the pixels that at least half of the fits call the person's."""
    return np.asarray(np.mean([fit.segment for fit in fits], axis=0) >= 0.5)


def costs_over(
    fitter: BodyFitter, bodies: Sequence[BodyState], observation: Observation,
    segment: Bool[np.ndarray, 'h w'],
) -> list[float]:
    """Return the cost of each body by E_depth over some pixels, keypoints and priors.

    The pose prior weighs as in a single frame, less than where people are followed: there it holds
    what is not seen over many frames, here it would speak against rare poses that are. Decisions
    are as good with either (`python -m benchmarks tracking`).
    """
    hypotheses = [_hypothesis(fitter, body) for body in bodies]
    fitter.steps.score(hypotheses, observation, segment)
    return [hypothesis.cost for hypothesis in hypotheses]


def with_limbs_of(
    warm: WarmStart, track: PersonTrack, best: WarmFit, other: WarmFit, observation: Observation,
    steps: int,
) -> WarmFit:
    """Return the better of two explanations, with those limbs that the other one has right.

    Its belief becomes the track's. What was followed knows a leg that moves little, what was found
    anew an arm that moved far.

    Args:
        warm: Fits and judges.
        track: The person, with the belief that `best` was fitted from.
        best: The better explanation.
        other: Another one of the same frame.
        observation: What the sensor says.
        steps: Of the fit of both together.
    """
    fitter, common = warm.fitter, common_segment([best, other])
    hypotheses = [_hypothesis(fitter, each.state) for each in (best, other)]

    def judge(trials: Sequence[Hypothesis]) -> None:
        fitter.steps.score(trials, observation, common)

    judge(hypotheses[:1])
    mixed = exchange_limbs(hypotheses[0], hypotheses[1:], judge).state.parameters
    turned = (mixed.body_pose != best.state.parameters.body_pose).any(axis=1)
    if not turned.any():
        return best
    belief = replace(loosened(track.filter, np.append(False, turned)), parameters=mixed)
    fit = warm.fit(belief, observation, steps, detected=True)
    ours, theirs = costs(fitter, [best, fit], observation)
    if theirs >= ours:
        return best
    track.filter = belief
    return fit


def _hypothesis(fitter: BodyFitter, body: BodyState) -> Hypothesis:
    return Hypothesis(body, PriorBelief(fitter.prior, body.parameters.body_pose, np.ones(23)))


def lead(track: PersonTrack, stamp_ns: int) -> float:
    """Return the cost by which a body that was found anew must be better to take over.

    Keypoints of one frame err together: who was followed well is believed more than them. Between
    the frames of a slow camera arms move far, and what is found in a frame is worth as much.

    Args:
        track: The person.
        stamp_ns: Stamp of the frame that the body was found in.
    """
    if track.gap_s > LONG_GAP_S and stamp_ns == track.now_ns:
        return 0.0
    return BETTER if track.tries > 0 else MUCH_BETTER


def distance_m(state: BodyState, other: BodyState) -> float:
    """Return the mean distance between the joints of two bodies [m]."""
    return float(np.linalg.norm(state.joints - other.joints, axis=1).mean())


def follow_alternatives(
    warm: WarmStart, track: PersonTrack, best: WarmFit, observation: Observation,
    config: TrackingConfig, *, detected: bool,
) -> WarmFit:
    """Follow the other explanations of a person; return the one that is best by now.

    Those that became the same as the best, or that evidence or time decided against, are dropped.
    When another takes over, its belief becomes the track's, and the old best is dropped.
    """
    kept = []
    winner = best
    for other in track.alternatives:
        fit = warm.fit(other.filter, observation, 1, detected=detected)
        ours, theirs = costs(warm.fitter, [best, fit], observation)
        other.excess += float(np.clip(theirs - ours, -LARGEST, LARGEST))
        if other.excess < -BETTER:
            track.filter, winner = other.filter, fit
            continue
        other.filter = updated(other.filter, fit)
        age_s = (track.now_ns - other.born_ns) * 1e-9
        is_open = other.excess < DECIDED and age_s <= config.undecided_s
        if is_open and distance_m(fit.state, best.state) > SAME_M:
            kept.append(other)
    track.alternatives = kept
    return winner
