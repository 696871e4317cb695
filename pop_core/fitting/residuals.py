"""Data terms of the fit: functions from a state to weighted residuals and their Jacobians.

Lengths in metres; weights are 1/sigma^2 times robust weights that count as constant in a step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pop_core.fitting import keypoint_kernels
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.levenberg_marquardt import Residual, no_residual
from pop_core.fitting.observation import KeypointRays
from pop_core.fitting.pair_kernels import merge, offsets
from pop_core.fitting.robust_loss import Power, geman_mcclure_share
from pop_core.keypoints.joint_belief import JointBelief
from pop_core.keypoints.lifted_joints import LiftedJoints

EXPECTED_SIGMAS = 3.0  # of a joint that keeps a quarter of its pull
RAY_SCALE_M = 0.4  # a guessed pixel may be on another limb


def joint_weight(
    state: BodyState, lifted: LiftedJoints, scale_m: float, power: Power
) -> Float[np.ndarray, 's']:
    """Return the robust weight 1/sigma^2 of every shared joint, zero unless lifted."""
    return np.asarray(keypoint_kernels.joint_weights(
        state.landmarks, lifted.positions_camera, lifted.sigma_m, scale_m, int(power)))


def joint_residual(
    state: BodyState, lifted: LiftedJoints, weight: Float[np.ndarray, 's'], *, jacobian: bool
) -> Residual:
    """Return E_J3D: offsets of the shared points from the lifted joints (Eq. 2)."""
    rows, r, w = keypoint_kernels.joint_offsets(state.landmarks, lifted.positions_camera, weight)
    J = state.landmark_jacobian[rows].reshape(-1, state.body.size) if jacobian else None
    return Residual(r, J, w)


def expected_weight(
    state: BodyState, expected: JointBelief | None, power: Power
) -> Float[np.ndarray, 's']:
    """Return the robust weight 1/sigma^2 of every shared joint that is expected somewhere."""
    if expected is None:
        return np.zeros(len(state.landmarks))
    off_m = np.linalg.norm(state.landmarks - expected.positions_camera, axis=1)
    share = geman_mcclure_share(off_m / expected.sigma_m, EXPECTED_SIGMAS) ** power
    return np.asarray(share / expected.sigma_m**2)


def expected_residual(
    state: BodyState, expected: JointBelief | None, weight: Float[np.ndarray, 's'],
    *, jacobian: bool,
) -> Residual:
    """Return offsets of the shared points from where they are expected."""
    if expected is None:
        return no_residual(state.body.size)
    rows, r, w = keypoint_kernels.joint_offsets(
        state.landmarks, expected.positions_camera, weight)
    J = state.landmark_jacobian[rows].reshape(-1, state.body.size) if jacobian else None
    return Residual(r, J, w)


def ray_weight(
    state: BodyState, rays: KeypointRays, power: Power
) -> Float[np.ndarray, 's']:
    """Return the weight 1/sigma^2 of keypoints that have a pixel but no depth, zero elsewhere.

    A detector's pixel of a hidden joint fixes its direction though nothing fixes its distance.
    """
    return np.asarray(keypoint_kernels.ray_weights(
        state.landmarks, rays.joint, rays.across, rays.score, rays.sigma, RAY_SCALE_M,
        int(power)))


def ray_residual(
    state: BodyState, rays: KeypointRays, weight: Float[np.ndarray, 's'], *, jacobian: bool
) -> Residual:
    """Return the distance of shared points to the rays of their keypoints, in two directions."""
    if len(rays.joint) == 0:
        return no_residual(state.body.size)
    distance = keypoint_kernels.ray_offsets(state.landmarks, rays.joint, rays.across)
    J = None
    if jacobian:
        J = (rays.across @ state.landmark_jacobian[rays.joint]).reshape(-1, state.body.size)
    return Residual(distance.reshape(-1), J, weight[rays.joint].repeat(2))


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Vertices and where they should go, each measured along one fixed direction.

    Point-to-plane pairs use the vertex's normal, free-space pairs the viewing ray, and
    point-to-point pairs come as three rows. Directions count as constant in a step.

    Args:
        vertex: Index into the fitting mesh.
        direction: Unit vector, camera frame.
        target: Point [m], camera frame.
        weight: 1/sigma^2, robustness included.
    """

    vertex: Int[np.ndarray, 'n']
    direction: Float[np.ndarray, 'n 3']
    target: Float[np.ndarray, 'n 3']
    weight: Float[np.ndarray, 'n']


def no_pairs() -> Pairs:
    """Return an empty set of pairs."""
    return Pairs(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))


def join_pairs(parts: Sequence[Pairs]) -> Pairs:
    """Return all pairs of several sets."""
    return Pairs(
        np.concatenate([part.vertex for part in parts]),
        np.concatenate([part.direction for part in parts]),
        np.concatenate([part.target for part in parts]),
        np.concatenate([part.weight for part in parts]),
    )


def merged_pairs(pairs: Pairs) -> tuple[Pairs, float]:
    """Return one pair for all pairs of a vertex, and by how much less it costs.

    Several measured points pull on one vertex along its one normal: sum w (n.x - n.t)^2 is
    W (n.x - n.m)^2 plus what does not depend on x, with W = sum w and m the weighted mean of the
    targets t. Gradient and curvature are the same, from a third of the rows.

    Args:
        pairs: Pairs whose direction is the same for all pairs of a vertex.
    """
    if len(pairs.vertex) == 0:
        return pairs, 0.0
    *merged, spread = merge(pairs.vertex, pairs.direction, pairs.target, pairs.weight)
    return Pairs(*merged), float(spread)


def pair_residual(state: BodyState, pairs: Pairs, *, jacobian: bool) -> Residual:
    """Return E_NN: offsets of vertices from their targets along each pair's direction."""
    r = offsets(state.vertices, pairs.vertex, pairs.direction, pairs.target)
    J = state.directional_jacobian(pairs.vertex, pairs.direction) if jacobian else None
    return Residual(r, J, pairs.weight)
