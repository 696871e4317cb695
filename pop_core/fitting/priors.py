"""Terms that keep a body plausible where the sensor is silent.

Each is a term of the parameters alone. Rotation derivatives are with respect to the
solver's left increments.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import TWIST_AXES, limit_excess
from pop_core.fitting import prior_kernels as kernels
from pop_core.fitting.body_state import BODY_POSE, BodyState
from pop_core.fitting.levenberg_marquardt import Quadratic
from pop_core.fitting.robust_kernels import geman_mcclure
from pop_core.fitting.robust_loss import Power
from pop_core.geometry.rotation import from_rotvec, to_rotvec
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import PosePrior

SCALE_SIGMA = 0.04  # log scale; the betas hold adults, scale is for children and giants
SMALLEST_SCALE = 1e-300  # has a logarithm
SCALE_TAIL = 2.5  # in sigmas: beyond it a small body is a child, not an unlikely adult
LIMIT_SIGMA_RAD = 0.05


def pose_prior_term(
    state: BodyState, prior: PosePrior, weight: float, *, jacobian: bool
) -> Quadratic:
    """Return the squared distance to the nearest component of the pose prior."""
    if not jacobian:
        return Quadratic(weight * prior.cost(state.coordinates))
    cost, gradient, hessian = prior.quadratic(state.coordinates)
    return Quadratic(weight * cost, weight * gradient, weight * hessian, BODY_POSE.start)


def limit_prior_term(state: BodyState, *, jacobian: bool) -> Quadratic:
    """Return by how much joints exceed their anatomical limits."""
    r = limit_excess(state.coordinates)
    weight = 1 / LIMIT_SIGMA_RAD**2
    cost = 0.5 * weight * float(np.vdot(r, r))
    if not jacobian or cost == 0.0:
        return Quadratic(cost)
    gradient, hessian = kernels.excess_model(r, state.coordinates, TWIST_AXES, weight)
    return Quadratic(cost, gradient, hessian, BODY_POSE.start)


def neighbour_sigma_rad(
    candidates: Sequence[PoseCandidate], low: float = 0.25, high: float = 0.9
) -> Float[np.ndarray, '23']:
    """Return how far the retrieved neighbours agree on each joint's rotation [rad].

    Small where every candidate says the same, large where the library knows many answers: the
    spread of the conditional prior of a pose given the joints that were seen.
    """
    R = np.stack([from_rotvec(candidate.body_pose) for candidate in candidates])
    weight = np.array([candidate.weight for candidate in candidates])
    relative = np.einsum('kjab,jcb->kjac', R, R[0])
    angle = np.linalg.norm(to_rotvec(relative), axis=-1)
    spread = np.sqrt(np.einsum('k,kj->j', weight / weight.sum(), angle**2))
    return np.clip(spread, low, high)


def conditional_prior_term(
    state: BodyState,
    pose: Float[np.ndarray, '23 3'],
    sigma_rad: Float[np.ndarray, '23'],
    weight: float,
    *,
    jacobian: bool,
) -> Quadratic:
    """Return the rotation from the retrieved pose, in units of the neighbours' spread."""
    if weight == 0.0:
        return Quadratic(0.0)
    r = kernels.turns(state.skeleton.R_local[1:], pose, sigma_rad)
    cost = 0.5 * weight * float(np.vdot(r, r))
    if not jacobian:
        return Quadratic(cost)
    gradient, hessian = kernels.turns_model(r, sigma_rad, weight)
    return Quadratic(cost, gradient, hessian, BODY_POSE.start)


def _log_scale(state: BodyState) -> float:
    """Return the log scale; of a body that a step shrank to nothing, a very small one."""
    return math.log(max(state.parameters.scale, SMALLEST_SCALE))


def scale_weight(state: BodyState, power: Power) -> float:
    """Return the robust weight of the scale prior: adults vary little, children much.

    It is robust to the small side only: there are children, but no giants.
    """
    deviation = max(-_log_scale(state), 0.0) / SCALE_SIGMA
    return float(geman_mcclure(deviation**2, SCALE_TAIL, int(power)))


def shape_prior_term(state: BodyState, of_scale: float) -> Quadratic:
    """Return betas in standard deviations and the log scale in units of its sigma.

    Args:
        state: Body.
        of_scale: Weight of the scale.
    """
    parameters = state.parameters
    weight = of_scale / SCALE_SIGMA**2
    log_scale = _log_scale(state)
    pull = np.empty(len(parameters.betas) + 1)
    pull[:-1], pull[-1] = parameters.betas, weight * log_scale
    hessian = np.eye(len(pull))
    hessian[-1, -1] = weight
    square = float(np.vdot(parameters.betas, parameters.betas)) + weight * log_scale**2
    return Quadratic(0.5 * square, pull, hessian, BODY_POSE.stop)
