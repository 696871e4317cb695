"""Learning of a `Calibration`: by likelihood first, then by what the ellipsoids should hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.optimize import minimize

from benchmarks.metrics import CHI2_3_68, CHI2_3_95
from pop_core.estimate import JointState
from pop_core.fitting.uncertainty import Calibration, JointEvidence, covariances, joined_evidence

# Errors have heavier tails than a normal distribution: Student's t of so many degrees of freedom.
FREEDOM = 7.0
AIMS = ((CHI2_3_68, 0.705, 0.015), (CHI2_3_95, 0.93, 0.01))  # radius^2, share inside, tolerance
SOFTNESS = 0.12  # of the edge of an ellipsoid, in logarithms of squared radii
LIKELIHOOD_WEIGHT = 1e-4  # per joint, beside the coverage: ellipsoids stay sharp
FEWEST = 50  # joints of a group whose coverage counts
MOST_EXPONENT = 40.0  # beyond it the logistic function is 0 or 1


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """Joints with their evidence and what became of them.

    Args:
        evidence: What was known.
        error_m: True place minus estimated place.
        truth: True JointState.
    """

    evidence: JointEvidence
    error_m: Float[np.ndarray, 'n 3']
    truth: Int[np.ndarray, 'n']


def joined(parts: Sequence[Sample]) -> Sample:
    """Return many samples as one; bodies with fewer runners-up get some at the winner's place."""
    most = max(part.evidence.rivals.shape[1] for part in parts)
    return Sample(
        joined_evidence([_with_rivals(part.evidence, most) for part in parts]),
        np.concatenate([part.error_m for part in parts]),
        np.concatenate([part.truth for part in parts]))


def learn(sample: Sample, start: Calibration) -> Calibration:
    """Return the calibration that states a sample's errors best.

    Args:
        sample: Joints.
        start: Where the search begins; what the sample says nothing about stays there.
    """
    begin = _vector(start)
    likely = _minimum(
        lambda x: _log_likelihood(x, start, sample) + 2.0 * ((x - begin) ** 2).sum(), begin)
    groups = _groups(sample)

    def loss(x: Float[np.ndarray, 'p']) -> float:
        coverage = _coverage_loss(_squared(x, start, sample)[0], groups)
        likelihood = LIKELIHOOD_WEIGHT * _log_likelihood(x, start, sample)
        return coverage + likelihood + 0.5 * float(((x - likely) ** 2).sum())

    return _calibration(_minimum(loss, likely), start)


def squared_radii(
    sample: Sample, calibration: Calibration
) -> tuple[Float[np.ndarray, 'n'], Float[np.ndarray, 'n']]:
    """Return squared errors in units of stated covariances, and their log determinants."""
    stated = covariances(sample.evidence, calibration)
    solved = np.linalg.solve(stated, sample.error_m[..., None])[..., 0]
    return (sample.error_m * solved).sum(axis=1), np.linalg.slogdet(stated)[1]


def _minimum(
    loss: Callable[[Float[np.ndarray, 'p']], float], start: Float[np.ndarray, 'p']
) -> Float[np.ndarray, 'p']:
    return np.asarray(minimize(loss, start, method='L-BFGS-B', options={'maxiter': 40}).x)


def _squared(
    x: Float[np.ndarray, 'p'], start: Calibration, sample: Sample
) -> tuple[Float[np.ndarray, 'n'], Float[np.ndarray, 'n']]:
    return squared_radii(sample, _calibration(x, start))


def _log_likelihood(
    x: Float[np.ndarray, 'p'], start: Calibration, sample: Sample
) -> float:
    """Return the negative log likelihood of Student's t, without its constant."""
    squared, log_det = _squared(x, start, sample)
    return float(0.5 * (log_det + (FREEDOM + 3) * np.log1p(squared / FREEDOM)).sum())


def _coverage_loss(
    squared: Float[np.ndarray, 'n'], groups: Sequence[tuple[Bool[np.ndarray, 'n'], float]]
) -> float:
    """Return how far the shares inside both ellipsoids are from their aims, group by group."""
    loss = 0.0
    for radius2, aim, tolerance in AIMS:
        outside = (np.log(squared + 1e-12) - np.log(radius2)) / SOFTNESS
        inside = 1.0 / (1.0 + np.exp(np.clip(outside, -MOST_EXPONENT, MOST_EXPONENT)))
        for chosen, weight in groups:
            loss += weight * ((float(inside[chosen].mean()) - aim) / tolerance) ** 2
    return loss


def _groups(sample: Sample) -> list[tuple[Bool[np.ndarray, 'n'], float]]:
    """Return groups that should be covered, with weights: what users are told, and the truth."""
    state, unnamed = sample.evidence.state, sample.evidence.unnamed
    seen = sample.truth == JointState.VISIBLE
    groups = [(sample.truth == s, 1.0) for s in JointState]
    groups += [(~seen, 1.0)]
    groups += [(state == s, 0.5) for s in JointState]
    groups += [
        (hidden & (sample.evidence.part == part), 0.3) for hidden in (~seen, seen)
        for part in range(3)]
    groups += [(unnamed & (state == s), 0.3) for s in JointState]
    return [(chosen, weight) for chosen, weight in groups if chosen.sum() > FEWEST]


def _vector(calibration: Calibration) -> Float[np.ndarray, 'p']:
    """Return what is learned as numbers without bounds."""
    c = calibration
    positive = [c.rival_share, c.rival_cost, *c.retrieved_share, c.floor_m]
    odds = c.roundness / (1.0 - c.roundness)
    return np.concatenate([
        np.log(c.inflation).ravel(), np.log(np.maximum(positive, 1e-6)), [np.log(odds)],
        [c.per_misfit / 10.0, c.per_strain], np.log(c.of_part), [c.compression]])


def _calibration(x: Float[np.ndarray, 'p'], start: Calibration) -> Calibration:
    """Invert `_vector`; the usual misfit and strain are those of `start`."""
    share, cost, named, unnamed, floor_m = np.exp(x[10:15]).tolist()
    return Calibration(
        inflation=np.exp(x[:10]).reshape(2, 5), of_part=np.exp(x[18:21]), compression=float(x[21]),
        rival_share=share, rival_cost=cost, retrieved_share=(named, unnamed),
        roundness=float(1.0 / (1.0 + np.exp(-x[15]))), floor_m=floor_m,
        per_misfit=float(10.0 * x[16]), per_strain=float(x[17]),
        usual_misfit_m=start.usual_misfit_m, usual_strain=start.usual_strain)


def _with_rivals(evidence: JointEvidence, count: int) -> JointEvidence:
    missing = count - evidence.rivals.shape[1]
    return JointEvidence(
        evidence.curvature, np.pad(evidence.rivals, ((0, 0), (0, missing), (0, 0))),
        np.pad(evidence.rival_excess, ((0, 0), (0, missing))), evidence.retrieved,
        evidence.unnamed, evidence.state, evidence.part, evidence.misfit_m, evidence.strain)
