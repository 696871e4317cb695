"""Consistency of a body with the depth image (step 8): visibility, free space and E_depth.

The paper's null-space: a body must not stand where the sensor saw through it. A vertex is compared
with the depth measured at its pixel: hidden behind something nearer it is free; in front of
something farther it contradicts the measurement and is pushed to where it can hide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int32

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.free_space_kernels import (
    gaps_along_rays,
    hidden_places,
    hiding_slices,
    pulls_aside,
)
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs, join_pairs
from pop_core.fitting.sight_kernels import mean_misfit, see
from pop_core.geometry.nearest_pixel_kernels import nearest_rows
from pop_core.rendering.depth_renderer import RenderedDepth, render_alike, render_depth

SELF_TOLERANCE_M = 0.03  # z-buffer against vertex: a triangle's own slope
CLOTHES_M = 0.03  # measured skin is cloth: it lies this far in front of the body at most
SMALL_GAP_M = 0.12  # up to here a body is pushed back along the ray, beyond it sideways
FREE_SIGMA_M = 0.03
PULL_SCALE_M = 0.3  # of the robust kernel of pulls sideways
DEPTH_SLICES = 5
DEPTH_LIMIT_M = 0.15  # a pixel's error in E_depth counts up to here


class Sight(IntEnum):
    """How a vertex relates to what the camera measured at its pixel."""

    VISIBLE = 0
    SELF_OCCLUDED = 1
    SCENE_OCCLUDED = 2
    OUT_OF_IMAGE = 3
    UNKNOWN = 4
    CONTRADICTED = 5


@dataclass(frozen=True, slots=True, eq=False)
class Visibility:
    """The sight of every vertex of a fitting mesh.

    Args:
        sight: A Sight per vertex.
        gap_m: Measured depth minus vertex depth [m]; NaN or inf where nothing was measured.
        rendered: The body's own depth image.
    """

    sight: Int[np.ndarray, 'n']
    gap_m: Float[np.ndarray, 'n']
    rendered: RenderedDepth

    @property
    def facing(self) -> Bool[np.ndarray, 'n']:
        """Return the vertices that nothing of the body itself hides."""
        return self.sight != Sight.SELF_OCCLUDED


def render_body(state: BodyState, observation: Observation) -> RenderedDepth:
    """Return a body as the camera of an observation would see it alone."""
    body = state.body
    return render_depth(state.vertices, body.faces, observation.camera, closed=body.is_closed)


def render_bodies(
    states: Sequence[BodyState], observation: Observation
) -> Float32[np.ndarray, 'k h w']:
    """Return the depth of each of several bodies of one mesh as the camera would see it alone [m].

    Trials of a limb share the rest of the body, which is then drawn once.
    """
    body = states[0].body if states else None
    return render_alike(
        [state.vertices for state in states],
        body.faces if body else np.zeros((0, 3), dtype=np.int64), observation.camera,
        closed=body.is_closed if body else False)


def see_body(state: BodyState, observation: Observation) -> Visibility:
    """Return the visibility of a body's vertices in an observation."""
    rendered, camera = render_body(state, observation), observation.camera
    margin = CLOTHES_M + 2 * observation.noise.sigma_m(state.vertices[:, 2])
    sight, gap = np.empty(len(margin), dtype=np.int64), np.empty(len(margin))
    see(state.vertices, state.normals, margin, camera.fx, camera.fy, camera.cx, camera.cy,
        observation.depth_m, observation.own, rendered.depth_m, SELF_TOLERANCE_M, sight, gap)
    return Visibility(sight, gap, rendered)


class HidingPlaces:
    """Where a body can hide, for slices of depth: over the person, something nearer, or nothing.

    Each slice is computed when a vertex first asks for it: most bodies need none.
    """

    def __init__(
        self, observation: Observation, segment: Bool[np.ndarray, 'h w'], z: Float[np.ndarray, 'n']
    ) -> None:
        """Prepare slices for a body whose vertices lie at depths z [m]."""
        self.observation, self.segment = observation, segment
        self.slices_m = np.linspace(z.min(), z.max(), DEPTH_SLICES)
        self._rows: dict[int, Int32[np.ndarray, 'h w']] = {}

    def targets(
        self, points: Float[np.ndarray, 'n 3']
    ) -> tuple[Float[np.ndarray, 'n 3'], Bool[np.ndarray, 'n']]:
        """Return the nearest hidden place at each point's depth [m], and whether there is one."""
        which = hiding_slices(points[:, 2], self.slices_m)
        target = np.full(points.shape, np.nan)
        camera = self.observation.camera
        for k in set(which.tolist()):
            hidden_places(
                self._slice(k), points, which == k, camera.fx, camera.fy, camera.cx, camera.cy,
                self.observation.rays, target)
        return target, ~np.isnan(target[:, 0])

    def _slice(self, k: int) -> Int32[np.ndarray, 'h w']:
        if k not in self._rows:
            depth_m = self.observation.depth_m[::2, ::2]
            # Not beyond: nor is what was not measured.
            self._rows[k] = nearest_rows(
                self.segment[::2, ::2] | ~(depth_m >= self.slices_m[k]))
        return self._rows[k]


def free_space_pairs(
    state: BodyState, visibility: Visibility, places: HidingPlaces
) -> Pairs:
    """Return where vertices that the sensor saw through should go (E_free).

    Small gaps are closed along the ray: the body merely stands too near. Large gaps mean that
    the limb is elsewhere: it is pulled sideways toward the nearest pixel that can hide it at its
    depth.
    """
    vertices = state.vertices
    along, large = gaps_along_rays(
        vertices, visibility.sight, visibility.gap_m, SMALL_GAP_M, 0.5 / FREE_SIGMA_M**2)
    target, known = places.targets(vertices[large])
    sideways = pulls_aside(
        vertices, large[known], target[known], 0.25 / FREE_SIGMA_M**2, PULL_SCALE_M)
    return join_pairs([Pairs(*along), Pairs(*sideways)])


def depth_energy(
    body_m: Float32[np.ndarray, 'h w'],
    observation: Observation,
    segment: Bool[np.ndarray, 'h w'],
    limit_m: float = DEPTH_LIMIT_M,
) -> float:
    """Return E_depth = |min(D_body, D_rest) - D_in|, truncated, per pixel of the segment.

    D_rest is the scene with the person's segment moved to the far plane. Three cases remain: a
    segment pixel the body leaves uncovered costs the limit; a body pixel in front of the
    measured depth costs its gap; a body behind the scene costs nothing.

    Args:
        body_m: D_body, +inf where there is none.
        observation: D_in.
        segment: The person's pixels, the same for every hypothesis that is compared.
        limit_m: Truncation of a pixel's cost [m].
    """
    return float(mean_misfit(body_m, observation.depth_m, segment, limit_m))


def free_space_violation(
    rendered: RenderedDepth, depth_m: Float32[np.ndarray, 'h w'], limit_m: float = 0.05
) -> float:
    """Return the share of rendered body pixels that stand in front of measured depth."""
    covered = rendered.covered & np.isfinite(depth_m)
    violating = rendered.depth_m[covered] < depth_m[covered] - limit_m
    return float(violating.mean()) if violating.size else 0.0
