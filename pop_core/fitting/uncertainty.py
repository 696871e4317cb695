"""Covariance of every joint: what the cost fixes, what hypotheses disagree about, what warns.

The curvature of the cost tells how far a joint may move before data and priors object. It does not
know that the whole body may be a wrong one. What does: hypotheses that ended elsewhere, limbs that
no keypoint names, depth left unexplained, a pose that strains the priors. How much each of them
widens the covariance is learned from errors on synthetic people (`python -m benchmarks
calibration`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import cho_factor, cho_solve

from pop_core.body.joints import JOINT_NAMES
from pop_core.body.kinematics import joints_jacobian, pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.body_fit import BodyFit
from pop_core.fitting.disagreement import ARM, LEG

# Widest factor of standard deviations by misfit and strain together: beyond what was learned from.
MOST_WIDENING = 4.0
TYPICAL_M = 0.03  # standard deviation by the curvature of a joint like most
PART_OF_JOINT = np.array([
    1 if name.endswith(tuple(ARM)) else 2 if name.endswith(tuple(LEG)) else 0
    for name in JOINT_NAMES])


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """How evidence becomes covariance.

    Args:
        inflation: Factor of standard deviations by JointState; in the second row of limb joints
            that no keypoint names.
        of_part: Factor of standard deviations of trunk, arms and legs.
        compression: How far the curvature's standard deviations are drawn toward TYPICAL_M: 1 to
            the same for all, 0 not at all; below 0 they are spread.
        rival_share: Share of a runner-up that costs no more than the winner.
        rival_cost: Excess cost at which that share has fallen to 1/e.
        retrieved_share: Share of the spread of all started hypotheses: of joints, and of limb
            joints that no keypoint names.
        roundness: Share 0..1 of the mean variance that goes to all directions alike.
        floor_m: Standard deviation that nothing is surer than [m].
        per_misfit: Growth of log standard deviations by E_depth [1/m] above the usual.
        per_strain: The same by the logarithm of E_prior.
        usual_misfit_m: E_depth of a body fitted right [m].
        usual_strain: Its log(1 + E_prior).
    """

    inflation: Float[np.ndarray, '2 5']
    of_part: Float[np.ndarray, '3']
    compression: float
    rival_share: float
    rival_cost: float
    retrieved_share: tuple[float, float]
    roundness: float
    floor_m: float
    per_misfit: float
    per_strain: float
    usual_misfit_m: float
    usual_strain: float


@dataclass(frozen=True, slots=True, eq=False)
class JointEvidence:
    """What is known of how wrong joints may be; of one body or of many, one row per joint.

    Args:
        curvature: (J'WJ)^-1 of the cost, carried to the joint [m^2].
        rivals: Where runners-up have the joint, from the winner's [m].
        rival_excess: What they cost beyond the winner.
        retrieved: Second moment of the joint over all started hypotheses [m^2].
        unnamed: Whether it is of a limb and no keypoint confirms it.
        state: A JointState.
        part: 0 of the trunk, 1 of an arm, 2 of a leg.
        misfit_m: E_depth of its body [m].
        strain: log(1 + E_prior) of its body.
    """

    curvature: Float[np.ndarray, 'n 3 3']
    rivals: Float[np.ndarray, 'n k 3']
    rival_excess: Float[np.ndarray, 'n k']
    retrieved: Float[np.ndarray, 'n 3 3']
    unnamed: Bool[np.ndarray, 'n']
    state: Int[np.ndarray, 'n']
    part: Int[np.ndarray, 'n']
    misfit_m: Float[np.ndarray, 'n']
    strain: Float[np.ndarray, 'n']


def joint_covariance(
    model: BodyModel, fit: BodyFit, state: Int[np.ndarray, '24'], calibration: Calibration
) -> Float[np.ndarray, '24 3 3']:
    """Return the covariance of each joint's position [m^2], camera frame.

    Args:
        model: Body.
        fit: Its fit.
        state: A JointState per joint.
        calibration: How much the evidence of such a fit tells.
    """
    return covariances(joint_evidence(model, fit, state, calibration), calibration)


def joint_evidence(
    model: BodyModel, fit: BodyFit, state: Int[np.ndarray, '24'], calibration: Calibration
) -> JointEvidence:
    """Return what speaks for and against the joints of a fit.

    A body of which nothing is seen has no energies: it counts as one of the usual.
    """
    left, count = fit.disagreement, len(state)
    misfit_m = fit.energies.get('E_depth', calibration.usual_misfit_m)
    strain = calibration.usual_strain
    if 'E_prior' in fit.energies:
        strain = float(np.log1p(fit.energies['E_prior']))
    return JointEvidence(
        curvature_covariance(model, fit.parameters, fit.hessian),
        left.rivals.transpose(1, 0, 2), np.tile(left.excess, (count, 1)), left.retrieved,
        left.unnamed, state, PART_OF_JOINT, np.full(count, misfit_m), np.full(count, strain))


def curvature_covariance(
    model: BodyModel, parameters: BodyParameters, hessian: Float[np.ndarray, 'x x']
) -> Float[np.ndarray, '24 3 3']:
    """Return (J'WJ)^-1 of a cost carried to the joints [m^2] (Laplace's approximation)."""
    J = joints_jacobian(model, parameters, pose_skeleton(model, parameters))
    damped = hessian + 1e-6 * np.diag(np.diag(hessian)) + 1e-9 * np.eye(len(hessian))
    solved = cho_solve(cho_factor(damped), J.reshape(3 * len(J), -1).T).T
    return np.asarray(J @ solved.reshape(J.shape).transpose(0, 2, 1))


def covariances(
    evidence: JointEvidence, calibration: Calibration
) -> Float[np.ndarray, 'n 3 3']:
    """Return covariances [m^2]: curvature and disagreement, rounded, and widened by warnings."""
    share = calibration.rival_share * np.exp(
        -np.maximum(evidence.rival_excess, 0.0) / calibration.rival_cost)
    offset = evidence.rivals * np.sqrt(share)[..., None]
    unnamed = evidence.unnamed.astype(np.int64)
    retrieved = np.array(calibration.retrieved_share)[unnamed, None, None] * evidence.retrieved
    disagreed = offset.transpose(0, 2, 1) @ offset + retrieved
    whole = _compressed(evidence.curvature, calibration) + disagreed
    # Nobody knows which way a wrong limb is wrong: part of every direction's doubt is all's.
    mean = np.trace(whole, axis1=1, axis2=2) / 3.0
    variance = (
        calibration.inflation[unnamed, evidence.state] * calibration.of_part[evidence.part]
        * _widening(evidence, calibration)) ** 2
    out = ((1.0 - calibration.roundness) * variance)[:, None, None] * whole
    diagonal = np.arange(3)
    out[:, diagonal, diagonal] += (
        calibration.roundness * variance * mean + calibration.floor_m**2)[:, None]
    return np.asarray(out)


def _compressed(
    curvature: Float[np.ndarray, 'n 3 3'], calibration: Calibration
) -> Float[np.ndarray, 'n 3 3']:
    """Return covariances drawn toward the usual size or away from it, shapes kept."""
    mean = np.trace(curvature, axis1=1, axis2=2) / 3.0
    factor = (np.maximum(mean, 1e-9) / TYPICAL_M**2) ** -calibration.compression
    return np.asarray(factor[:, None, None] * curvature)


def _widening(
    evidence: JointEvidence, calibration: Calibration
) -> Float[np.ndarray, 'n']:
    """Return the factor of standard deviations of bodies that fit worse than usual."""
    excess = (
        calibration.per_misfit * (evidence.misfit_m - calibration.usual_misfit_m)
        + calibration.per_strain * (evidence.strain - calibration.usual_strain))
    return np.asarray(np.minimum(np.exp(excess), MOST_WIDENING))


def joined_evidence(parts: Sequence[JointEvidence]) -> JointEvidence:
    """Return the evidence of many bodies as one."""
    names = JointEvidence.__slots__
    return JointEvidence(**{
        name: np.concatenate([getattr(part, name) for part in parts]) for name in names})
