"""Pairs of measured points and body vertices for the surface term E_NN, in both directions."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import N_JOINTS, PARENTS
from pop_core.depth_noise import DepthNoise
from pop_core.fitting.body_state import BodyState
from pop_core.fitting.depth_consistency import Sight, Visibility
from pop_core.fitting.nearest_kernels import nearest, shrunk
from pop_core.fitting.observation import Observation
from pop_core.fitting.pair_kernels import merge_axes, plane_pairs
from pop_core.fitting.residuals import Pairs, no_pairs

SKIN_SIGMA_M = 0.010  # clothes, hair and the coarse mesh: never trust a point more than this
EFFECTIVE_POINTS = 1000.0  # neighbouring pixels err together; so many are worth independent ones
UNSETTLED_M = 0.02  # by how much less than the kernel's scale a body is taken to be off
NEAREST_M = 0.1  # sensors measure nothing nearer
VERTEX_SHARE = 0.3  # weight of vertex-to-point pairs beside point-to-vertex pairs


def _near_parts() -> Bool[np.ndarray, '24 24']:
    """Return which parts are at most two bones apart: borders between parts are vague."""
    linked = np.eye(N_JOINTS, dtype=bool)
    for child, parent in enumerate(PARENTS):
        if parent >= 0:
            linked[child, parent] = linked[parent, child] = True
    return np.asarray(linked @ linked)


NEAR_PARTS = _near_parts()


def thin_points(
    observation: Observation, segment: Bool[np.ndarray, 'h w'], most: int
) -> tuple[Float[np.ndarray, 'n 3'], Int[np.ndarray, 'n']]:
    """Return at most `most` points of the segment, evenly over its pixels, and their parts."""
    every = np.flatnonzero(segment)
    pixel = every[:: max(1, -(-len(every) // most))]
    parts = np.full(len(pixel), -1)
    if observation.labels is not None:
        parts = observation.labels.reshape(-1)[pixel].astype(np.int64)
    return observation.points_at(pixel), parts


def match_points(
    state: BodyState,
    visibility: Visibility,
    points: Float[np.ndarray, 'n 3'],
    parts: Int[np.ndarray, 'n'],
    scale_m: float,
    noise: DepthNoise,
) -> Pairs:
    """Pair every measured point with its nearest vertex that faces the camera (pi_NN of E_NN).

    Nearest is meant as sensors err, along their rays: a point that noise has put behind a rounded
    surface belongs to where its ray meets it. By plain distance such points would all pull on the
    sides, inward, and a body far from the camera would be fitted too thin.

    Args:
        state: Body.
        visibility: Which vertices face the camera.
        points: Measured points of H [m].
        parts: Joint of the body part each point was recognised as, -1 where it was not.
        scale_m: Scale of the robust kernel [m].
        noise: Noise of the measured depth.
    """
    facing = np.flatnonzero(visibility.facing)
    if len(facing) == 0 or len(points) == 0:
        return no_pairs()
    vertex = facing[nearest_as_sensors_err(state.clothed[facing], points, scale_m, noise)]
    # A point recognised as an arm never pulls on the chest it rests on.
    worth = EFFECTIVE_POINTS * _belong_together(parts, state.body.main_bone[vertex])
    return _plane_pairs(state, vertex, points, worth, scale_m, noise)


def nearest_as_sensors_err(
    surface: Float[np.ndarray, 'm 3'],
    points: Float[np.ndarray, 'n 3'],
    scale_m: float,
    noise: DepthNoise,
) -> Int[np.ndarray, 'n']:
    """Return the row of the surface's points that each measured point most probably shows.

    A body that is still off is so in all directions; a sensor errs along its rays. The larger the
    noise beside what the kernel expects of the body, the less distances along rays count.

    Args:
        surface: Points that the sensor may have seen [m].
        points: Measured points [m].
        scale_m: Scale of the robust kernel [m].
        noise: Noise of the measured depth.
    """
    middle_m = np.median(points[:, 2], keepdims=True)
    off_m = max(scale_m - UNSETTLED_M, SKIN_SIGMA_M)
    shrink = float(off_m / np.hypot(off_m, noise.sigma_m(middle_m))[0])
    # Behind the camera nothing is measured: there a vertex only has to stay away from all points.
    places, found = (
        shrunk(p_camera, float(middle_m[0]), shrink, NEAREST_M) for p_camera in (surface, points))
    return np.asarray(nearest(found, places)[0])


def match_vertices(
    state: BodyState, visibility: Visibility, observation: Observation, scale_m: float
) -> Pairs:
    """Pair every visible vertex with the point measured at its pixel, unless it is another part.

    Args:
        state: Body.
        visibility: Sight of its vertices in the observation.
        observation: What the sensor says.
        scale_m: Scale of the robust kernel [m].
    """
    vertex = np.flatnonzero(visibility.sight == Sight.VISIBLE)
    if len(vertex) == 0:
        return no_pairs()
    seen = state.vertices[vertex]
    target = seen * (1 + visibility.gap_m[vertex] / seen[:, 2])[:, None]
    worth = np.full(len(vertex), VERTEX_SHARE * EFFECTIVE_POINTS)
    if observation.labels is not None:
        u, v = observation.depth_at(seen)[1].T
        worth *= _belong_together(observation.labels[v, u], state.body.main_bone[vertex])
    return _plane_pairs(state, vertex, target, worth, scale_m, observation.noise)


def _belong_together(
    parts: Int[np.ndarray, 'n'], bones: Int[np.ndarray, 'n']
) -> Bool[np.ndarray, 'n']:
    """Return where a recognised part is a vertex's own or near it, or nothing was recognised."""
    return np.asarray((parts < 0) | NEAR_PARTS[parts, bones])


def _plane_pairs(
    state: BodyState,
    vertex: Int[np.ndarray, 'n'],
    target: Float[np.ndarray, 'n 3'],
    worth: Float[np.ndarray, 'n'],
    scale_m: float,
    noise: DepthNoise,
) -> Pairs:
    """Return point-to-plane pairs weighted by cos(theta) / sigma^2(z, theta), robustly.

    A sensor errs along its ray: a surface seen at a slant feels cos(theta) of that.

    Args:
        state: Body.
        vertex: Vertex of each pair.
        target: Measured point of each pair [m].
        worth: Weight of each pair, times the number of independent points that all pairs together
            count for.
        scale_m: Scale of the robust kernel [m].
        noise: Noise of the measured depth.
    """
    sigma_m = noise.sigma_m(target[:, 2])
    return Pairs(vertex, *plane_pairs(
        vertex, target, worth, sigma_m, SKIN_SIGMA_M, scale_m, state.vertices, state.normals,
        state.body.cloth_m))


def tangential_pairs(pairs: Pairs, share: float) -> tuple[Pairs, float]:
    """Return the same pairs as point to point, at a share of their weight; merged.

    Planes let a limb slide along itself; a weak pull in all directions keeps it from drifting
    while the pose is still wrong. Every third pair stands for three: it is a weak, smooth force.

    Returns:
        The pairs, those of one vertex merged, and by how much less they cost for that.
    """
    if len(pairs.vertex) == 0:
        return pairs, 0.0
    *merged, spread = merge_axes(
        pairs.vertex[::3], pairs.target[::3], 3.0 * share * pairs.weight[::3])
    return Pairs(*merged), float(spread)
