"""Self-collision: limbs do not pass through the trunk or through each other.

Depth and keypoints leave hidden limbs free, and a forearm that nobody sees fits well inside the
belly. Where two capsules of the body overlap, how deep they do is a residual; elsewhere there is
none (a hinge).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.capsule_kernels import overlaps
from pop_core.body.capsules import BodyCapsules
from pop_core.body.kinematics import attached_jacobian, attached_places
from pop_core.body.model import AttachedPoints
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
    return Overlaps(*overlaps(
        ends.reshape(2, -1, 3), _radius(capsules, state), capsules.pairs))


def collision_residual(state: BodyState, weight: float, *, jacobian: bool) -> Residual:
    """Return how deep capsules of a body overlap [m].

    The nearest points slide along their axes without changing the distance to first order, so the
    derivative holds them in place.
    """
    if weight == 0.0:
        return no_residual(state.body.size)
    found = find_overlaps(state)
    w = np.full(len(found.depth_m), weight / OVERLAP_SIGMA_M**2)
    J = _jacobian(state, found) if jacobian else None
    return Residual(found.depth_m, J, w)


def _jacobian(state: BodyState, found: Overlaps) -> Float[np.ndarray, 'n x']:
    body, parameters = state.body, state.parameters
    capsules, pair = body.capsules, found.pair
    J = np.zeros((len(pair), body.size))
    if len(pair):
        first, second = attached_jacobian(
            _nearest_points(capsules, found), body.model, parameters, state.skeleton,
        ).reshape(2, len(pair), 3, body.size)
        J = np.einsum('nc,ncx->nx', found.away, second - first)
        J[:, betas_slice(body.model.n_betas)] += (
            parameters.scale * capsules.radius_shapedirs[pair].sum(axis=1))
        J[:, -1] += _radius(capsules, state)[pair].sum(axis=1)
    return J


def _nearest_points(capsules: BodyCapsules, found: Overlaps) -> AttachedPoints:
    """Return the nearest points of all overlaps, those of first capsules before the others."""
    ends, capsule = capsules.ends, found.pair.T.reshape(-1)
    far = capsule + len(capsules.radius)
    share = found.share.T.reshape(-1, 1)
    return AttachedPoints(
        ends.joint[capsule],
        ends.template[capsule] * (1 - share) + ends.template[far] * share,
        ends.shapedirs[capsule] * (1 - share[..., None]) + ends.shapedirs[far] * share[..., None])


def _radius(capsules: BodyCapsules, state: BodyState) -> Float[np.ndarray, 'n']:
    """Return the radii of a shaped and scaled body [m]."""
    parameters = state.parameters
    return parameters.scale * (
        capsules.radius + capsules.radius_shapedirs @ parameters.betas)
