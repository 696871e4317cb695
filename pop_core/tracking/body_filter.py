"""Error-state Kalman filter of one body on SO(3)^24 x R^3, with velocities and a slow shape.

Errors are the solver's left increments: the true rotation of a joint is exp(error) R. A fit that
holds the prediction as one of its residuals finds the maximum of prediction times measurement, so
it is the update of the pose (an iterated Kalman filter; Bell and Cathey 1993); what remains is to
carry it to the velocities.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import lapack

from pop_core.body.kinematics import increment, pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.fitting.levenberg_marquardt import with_lower
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.tracking.motion import (
    BETA_DRIFT,
    N_MOVING,
    SCALE_DRIFT,
    SPEED,
    motion_noise,
)

MOVING = slice(0, N_MOVING)
# A library pose may be wrong by this much where nothing was seen [m, rad, beta, log scale].
FIRST_SIGMA = (0.3, 0.6, 1.0, 0.1)


@dataclass(frozen=True, slots=True, eq=False)
class FilterState:
    """What is believed of a body at one moment.

    Args:
        parameters: Mean, camera frame.
        velocity: Mean velocity of translation [m/s] and rotation increments [rad/s].
        covariance: Of translation, rotation increments, betas and log scale.
        mixed: Covariance of those with the velocities.
        velocity_covariance: Covariance of the velocities.
    """

    parameters: BodyParameters
    velocity: Float[np.ndarray, '75']
    covariance: Float[np.ndarray, 'x x']
    mixed: Float[np.ndarray, 'x 75']
    velocity_covariance: Float[np.ndarray, '75 75']


def first_state(parameters: BodyParameters, hessian: Float[np.ndarray, 'x x']) -> FilterState:
    """Return the belief after a first fit: nothing is known of how the person moves.

    Args:
        parameters: The fit.
        hessian: J'WJ of the fit; vague directions get the width of a guess.
    """
    size = len(hessian)
    transl, turn, beta, scale = FIRST_SIGMA
    sigma = np.full(size, turn)
    sigma[:3], sigma[N_MOVING: -1], sigma[-1] = transl, beta, scale
    covariance = inverse(hessian + np.diag(sigma**-2.0))
    return FilterState(
        parameters, np.zeros(N_MOVING), covariance, np.zeros((size, N_MOVING)),
        np.diag(SPEED**2))


def predict(
    state: FilterState, model: BodyModel, dt_s: float,
    liveliness: Float[np.ndarray, '75'] | float = 1.0,
) -> FilterState:
    """Return the belief a time step later, nothing having been seen.

    Args:
        state: The belief.
        model: The body it is of.
        dt_s: Time step [s].
        liveliness: Share of the usual velocity noise of each coordinate.
    """
    noise = motion_noise(dt_s, liveliness)
    step = np.zeros(len(state.covariance))
    step[MOVING] = noise.reach_s * state.velocity
    parameters = increment(state.parameters, step, pose_skeleton(model, state.parameters))
    # position error' = turn (error + reach velocity error), velocity error' = decay velocity error
    covariance, mixed = state.covariance.copy(), state.mixed.copy()
    reach = noise.reach_s
    covariance[MOVING] += reach[:, None] * state.mixed.T
    mixed[MOVING] += reach[:, None] * state.velocity_covariance
    covariance[:, MOVING] += mixed * reach
    turn = from_rotvec(step[3:N_MOVING].reshape(-1, 3))
    covariance = _turned(_turned(covariance, turn).T, turn)
    mixed = _turned(mixed, turn) * noise.decay
    velocity_covariance = noise.decay[:, None] * state.velocity_covariance * noise.decay
    diagonal = np.arange(N_MOVING)
    covariance[diagonal, diagonal] += noise.position
    mixed[diagonal, diagonal] += noise.mixed
    velocity_covariance[diagonal, diagonal] += noise.velocity
    shape = np.arange(N_MOVING, len(step))
    covariance[shape, shape] += dt_s * _shape_drift(len(shape)) ** 2
    return FilterState(
        parameters, noise.decay * state.velocity, covariance, mixed, velocity_covariance)


def update(
    predicted: FilterState, fitted: BodyParameters, before: Float[np.ndarray, 'x x'],
    information: Float[np.ndarray, 'x x'],
) -> FilterState:
    """Return the belief after a fit that held the prediction as a residual.

    Args:
        predicted: The belief before.
        fitted: The fit, already the mean of prediction, measurement and priors.
        before: Inverse of the predicted covariance.
        information: J'WJ of what was measured, without priors and without the prediction.
    """
    covariance = inverse(before + information)
    gain = predicted.mixed.T @ before
    # Speeds are learned from what was seen: a prior that pulls a hidden limb is no motion.
    seen = np.eye(len(before)) - covariance @ before
    moved = seen @ difference(fitted, predicted.parameters)
    lost = predicted.covariance - covariance
    return FilterState(
        fitted, predicted.velocity + gain @ moved, covariance, covariance @ gain.T,
        _symmetric(predicted.velocity_covariance - gain @ lost @ gain.T))


def with_known_shape(state: FilterState, known: FilterState, model: BodyModel) -> FilterState:
    """Return a belief of a new pose that also holds a person's known shape, and their walk."""
    shape = slice(N_MOVING, None)
    information = np.zeros_like(state.covariance)
    information[shape, shape] = inverse(known.covariance[shape, shape])
    covariance = inverse(inverse(state.covariance) + information)
    step = covariance @ information @ difference(known.parameters, state.parameters)
    parameters = increment(state.parameters, step, pose_skeleton(model, state.parameters))
    velocity = np.zeros(N_MOVING)
    velocity[:3] = known.velocity[:3]
    return replace(state, parameters=parameters, covariance=covariance, velocity=velocity)


def difference(
    parameters: BodyParameters, reference: BodyParameters
) -> Float[np.ndarray, 'x']:
    """Return the step that leads from a reference to other parameters: inverse of increment."""
    R_to, R_from = (
        from_rotvec(np.vstack([p.global_orient, p.body_pose])) for p in (parameters, reference))
    turn = to_rotvec(R_to @ R_from.transpose(0, 2, 1))
    return np.concatenate([
        parameters.transl - reference.transl, turn.reshape(-1),
        parameters.betas - reference.betas,
        [np.log(parameters.scale / reference.scale)]])


def _shape_drift(size: int) -> Float[np.ndarray, 's']:
    """Return the random walk of betas and log scale [1/sqrt(s)]."""
    drift = np.full(size, BETA_DRIFT)
    drift[-1] = SCALE_DRIFT
    return drift


def _turned(
    matrix: Float[np.ndarray, 'x y'], turn: Float[np.ndarray, '24 3 3']
) -> Float[np.ndarray, 'x y']:
    """Return a matrix whose rows of rotation increments are turned from the left."""
    out = matrix.copy()
    rows = matrix[3:N_MOVING].reshape(len(turn), 3, -1)
    out[3:N_MOVING] = (turn @ rows).reshape(N_MOVING - 3, -1)
    return out


def inverse(matrix: Float[np.ndarray, 'x x']) -> Float[np.ndarray, 'x x']:
    """Return the inverse of a symmetric positive definite matrix."""
    # Relative jitter: information of a metre and of a beta differ by orders of magnitude.
    jittered = matrix.copy()
    jittered[np.diag_indices(len(matrix))] *= 1.0 + 1e-9
    # A third of the work of solving for the unit matrix.
    factor, failed = lapack.dpotrf(jittered, overwrite_a=1)
    if failed:
        raise np.linalg.LinAlgError(f'expected a positive definite matrix, found {matrix}')
    return with_lower(lapack.dpotri(factor, overwrite_c=1)[0])


def _symmetric(matrix: Float[np.ndarray, 'x x']) -> Float[np.ndarray, 'x x']:
    return (matrix + matrix.T) / 2
