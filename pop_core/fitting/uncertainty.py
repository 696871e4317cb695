"""Covariance of every joint: what the data and priors fix, and what hypotheses disagree about."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_factor, cho_solve

from pop_core.body.kinematics import joints, joints_jacobian, pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters
from pop_core.estimate import JointState

# Standard deviations are multiplied by these, and floored, so that 68 and 95 % ellipsoids of
# synthetic frames cover their share (`python -m benchmarks accuracy`, coverage rows). Errors have
# heavier tails than a normal distribution: some fits are wrong as a whole.
INFLATION = {
    JointState.VISIBLE: 1.15, JointState.SELF_OCCLUDED: 1.45, JointState.SCENE_OCCLUDED: 1.45,
    JointState.OUT_OF_IMAGE: 1.5, JointState.UNKNOWN: 1.45,
}
MISFIT_INFLATION = 4.0  # a body that leaves depth unexplained is likelier to be wrong as a whole
FLOOR_M = 0.006


def joint_covariance(
    model: BodyModel,
    parameters: BodyParameters,
    hessian: Float[np.ndarray, 'x x'],
    runners_up: Sequence[BodyParameters],
    state: Int[np.ndarray, '24'],
    support: float = 1.0,
) -> Float[np.ndarray, '24 3 3']:
    """Return the covariance of each joint's position [m^2], camera frame.

    (J'WJ)^-1 of the winner carried to the joints, plus the spread between the hypotheses that
    survived, calibrated per state.

    Args:
        model: Body.
        parameters: The winner.
        hessian: J'WJ of data and prior terms at the winner.
        runners_up: The other hypotheses.
        state: A JointState per joint.
        support: Share of the body in view that measured depth agrees with.
    """
    skeleton = pose_skeleton(model, parameters)
    J = joints_jacobian(model, parameters, skeleton)
    damped = hessian + 1e-6 * np.diag(np.diag(hessian)) + 1e-9 * np.eye(len(hessian))
    solved = cho_solve(cho_factor(damped), J.reshape(3 * len(J), -1).T).T
    covariance = J @ solved.reshape(J.shape).transpose(0, 2, 1)
    here = joints(model, parameters)
    for other in runners_up:
        offset = joints(model, other) - here
        covariance += np.einsum('ja,jb->jab', offset, offset) / (len(runners_up) + 1)
    inflation = np.array([INFLATION[JointState(int(s))] for s in state])
    inflation *= 1.0 + MISFIT_INFLATION * (1.0 - support)
    return covariance * inflation[:, None, None] ** 2 + FLOOR_M**2 * np.eye(3)
