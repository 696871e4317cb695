"""Self-collision: limbs do not pass through the trunk or through each other.

Depth and keypoints leave hidden limbs free, and a forearm that nobody sees fits well inside the
belly. Where two capsules of the body overlap, how deep they do is a residual; elsewhere there is
none (a hinge).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.capsule_kernels import closest_shares
from pop_core.body.capsules import BodyCapsules
from pop_core.body.kinematics import attached_jacobian, attached_places
from pop_core.fitting.body_state import BodyState, betas_slice
from pop_core.fitting.levenberg_marquardt import Residual, no_residual

OVERLAP_SIGMA_M = 0.02


@dataclass(frozen=True, slots=True, eq=False)
class Overlaps:
    """Pairs of capsules that overlap, and where they are nearest.

    Args:
        pair: The two capsules.
        share: Where along each axis the nearest points lie, 0..1.
        depth_m: Sum of radii minus the distance of the axes [m].
        away: Unit vector from the second axis to the first, camera frame.
    """

    pair: Int[np.ndarray, 'n 2']
    share: Float[np.ndarray, 'n 2']
    depth_m: Float[np.ndarray, 'n']
    away: Float[np.ndarray, 'n 3']


def find_overlaps(state: BodyState) -> Overlaps:
    """Return the capsules of a body that overlap."""
    capsules, parameters = state.body.capsules, state.parameters
    ends = parameters.transl + parameters.scale * attached_places(
        capsules.ends, state.skeleton, parameters.betas)
    ends = ends.reshape(2, -1, 3)
    share, distance = closest_shares(ends, capsules.pairs)
    radius = _radius(capsules, state)
    depth = radius[capsules.pairs].sum(axis=1) - distance
    rows = np.flatnonzero(depth > 0)
    pair, share = capsules.pairs[rows], share[rows]
    nearest = ends[0, pair] + share[:, :, None] * (ends[1, pair] - ends[0, pair])
    offset = nearest[:, 0] - nearest[:, 1]
    # Axes that cross have no direction apart, and one step moves them off each other.
    away = offset / np.maximum(distance[rows], 1e-9)[:, None]
    return Overlaps(pair, share, depth[rows], away)


def collision_residual(state: BodyState, weight: float, *, jacobian: bool) -> Residual:
    """Return how deep capsules of a body overlap [m].

    The nearest points slide along their axes without changing the distance to first order, so the
    derivative holds them in place.
    """
    if weight == 0.0:
        return no_residual(state.body.size)
    overlaps = find_overlaps(state)
    w = np.full(len(overlaps.depth_m), weight / OVERLAP_SIGMA_M**2)
    J = _jacobian(state, overlaps) if jacobian else None
    return Residual(overlaps.depth_m, J, w)


def _jacobian(state: BodyState, overlaps: Overlaps) -> Float[np.ndarray, 'n x']:
    body, parameters = state.body, state.parameters
    capsules, rows = body.capsules, len(overlaps.depth_m)
    if rows == 0:
        return np.zeros((0, body.size))
    of_ends = attached_jacobian(
        capsules.ends, body.model, parameters, state.skeleton).reshape(2, -1, 3, body.size)
    first, second = overlaps.pair.T
    s, t = overlaps.share.T[..., None, None]
    apart = (
        (1 - s) * of_ends[0, first] + s * of_ends[1, first]
        - (1 - t) * of_ends[0, second] - t * of_ends[1, second])
    J = -np.einsum('nc,ncx->nx', overlaps.away, apart)
    J[:, betas_slice(body.model.n_betas)] += (
        parameters.scale * capsules.radius_shapedirs[overlaps.pair].sum(axis=1))
    J[:, -1] += _radius(capsules, state)[overlaps.pair].sum(axis=1)
    return J


def _radius(capsules: BodyCapsules, state: BodyState) -> Float[np.ndarray, 'n']:
    """Return the radii of a shaped and scaled body [m]."""
    parameters = state.parameters
    return parameters.scale * (
        capsules.radius + capsules.radius_shapedirs @ parameters.betas)
