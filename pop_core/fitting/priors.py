"""Terms that keep a body plausible where the sensor is silent.

Each is a term of the parameters alone. Rotation derivatives are with respect to the
solver's left increments.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from pop_core.body.joint_limits import limit_residual
from pop_core.fitting.body_state import BODY_POSE, BodyState, betas_slice
from pop_core.fitting.levenberg_marquardt import Quadratic, Residual, no_residual
from pop_core.fitting.robust_loss import Kernel
from pop_core.geometry.rotation import from_rotvec, left_jacobian_inverse, to_rotvec
from pop_core.retrieval.candidate import PoseCandidate
from pop_core.retrieval.pose_prior import PosePrior

SCALE_SIGMA = 0.04  # log scale; the betas hold adults, scale is for children and giants
SCALE_TAIL = 2.5  # in sigmas: beyond it a small body is a child, not an unlikely adult
LIMIT_SIGMA_RAD = 0.05


def pose_prior_term(
    state: BodyState, prior: PosePrior, weight: float, *, jacobian: bool
) -> Quadratic:
    """Return the squared distance to the nearest component of the pose prior."""
    pose = state.parameters.body_pose
    if not jacobian:
        return Quadratic(weight * prior.cost(pose))
    cost, of_pose, curvature = prior.quadratic(pose)
    gradient, hessian = np.zeros(state.body.size), np.zeros((state.body.size, state.body.size))
    gradient[BODY_POSE] = weight * of_pose
    hessian[BODY_POSE, BODY_POSE] = weight * curvature
    return Quadratic(weight * cost, gradient, hessian)


def limit_prior_residual(state: BodyState, *, jacobian: bool) -> Residual:
    """Return by how much joints exceed their anatomical limits [rad]."""
    r, J = limit_residual(state.parameters.body_pose)
    beyond = r != 0.0
    weight = np.full(int(beyond.sum()), 1 / LIMIT_SIGMA_RAD**2)
    return Residual(r[beyond], _at(state, J[beyond], BODY_POSE) if jacobian else None, weight)


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


def conditional_prior_residual(
    state: BodyState,
    pose: Float[np.ndarray, '23 3'],
    sigma_rad: Float[np.ndarray, '23'],
    weight: float,
    *,
    jacobian: bool,
) -> Residual:
    """Return the rotation from the retrieved pose, in units of the neighbours' spread."""
    if weight == 0.0:
        return no_residual(state.body.size)
    R = state.skeleton.R_local[1:]
    turn = to_rotvec(R @ from_rotvec(pose).transpose(0, 2, 1))
    r = (turn / sigma_rad[:, None]).reshape(-1)
    J = None
    if jacobian:
        blocks = left_jacobian_inverse(turn) / sigma_rad[:, None, None]
        J = np.zeros((69, state.body.size))
        for j, block in enumerate(blocks):
            J[3 * j: 3 * j + 3, 6 + 3 * j: 9 + 3 * j] = block
    return Residual(r, J, np.full(69, weight))


def scale_weight(state: BodyState, kernel: Kernel) -> float:
    """Return the robust weight of the scale prior: adults vary little, children much."""
    deviation = abs(np.log(state.parameters.scale)) / SCALE_SIGMA
    return float(kernel(np.array([deviation]), SCALE_TAIL)[0])


def shape_prior_residual(state: BodyState, of_scale: float, *, jacobian: bool) -> Residual:
    """Return betas in standard deviations and the log scale in units of its sigma.

    Args:
        state: Body.
        of_scale: Weight of the scale.
        jacobian: Whether derivatives are wanted.
    """
    parameters, size = state.parameters, state.body.size
    n = len(parameters.betas)
    r = np.append(parameters.betas, np.log(parameters.scale) / SCALE_SIGMA)
    J = None
    if jacobian:
        J = np.zeros((n + 1, size))
        J[:n, betas_slice(n)] = np.eye(n)
        J[n, -1] = 1 / SCALE_SIGMA
    return Residual(r, J, np.append(np.ones(n), of_scale))


def _at(state: BodyState, J: Float[np.ndarray, 'n m'], columns: slice) -> Float[np.ndarray, 'n x']:
    out = np.zeros((len(J), state.body.size))
    out[:, columns] = J
    return out
