"""The surface terms of a tracked body: what the depth image says of it, and what it forbids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from pop_core.fitting.body_state import BodyState
from pop_core.fitting.correspondence import match_points, match_vertices, thin_points
from pop_core.fitting.depth_consistency import HidingPlaces, Visibility, free_space_pairs
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.fitting.ground_contact import ground_pairs
from pop_core.fitting.observation import Observation
from pop_core.fitting.residuals import Pairs, join_pairs, merged_pairs
from pop_core.tracking.limb_claims import LimbClaims


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceTerms:
    """Pairs of one step.

    Args:
        pairs: All pairs; the first ones are of measured points.
        n_measured: How many. The others only forbid: a limb that is pushed out of the open may be
            anywhere behind, so that they add nothing to what is known.
        of_limb: Weight of measured points that each of LIMBS claims.
        spread: Cost of the measured points of one vertex lying apart, whatever the body does.
    """

    pairs: Pairs
    n_measured: int
    of_limb: Float[np.ndarray, '4']
    spread: float

    def without(self, bones: Bool[np.ndarray, '24'], state: BodyState) -> SurfaceTerms:
        """Return the terms without those of some bones."""
        keep = ~bones[state.body.main_bone[self.pairs.vertex]]
        pairs = self.pairs
        return SurfaceTerms(
            Pairs(pairs.vertex[keep], pairs.direction[keep], pairs.target[keep],
                  pairs.weight[keep]),
            int(keep[: self.n_measured].sum()), self.of_limb, self.spread)


def surface_terms(
    state: BodyState, observation: Observation, visibility: Visibility,
    segment: Bool[np.ndarray, 'h w'], *, places: HidingPlaces, claims: LimbClaims,
    scale_m: float, config: FittingConfig,
) -> SurfaceTerms:
    """Return the surface terms of a step.

    Args:
        state: Body.
        observation: What the sensor says.
        visibility: Sight of the body's vertices.
        segment: Pixels of the person.
        places: Where the body can hide.
        claims: Which points limbs may claim.
        scale_m: Scale of the robust kernel [m].
        config: How many points, and whether free space counts.
    """
    points, labels = thin_points(observation, segment, config.surface_points)
    # Planes only: a point tied to its nearest vertex holds a body that slides where it is,
    # and the filter would take that for knowledge.
    measured, of_limb = claims.weighed(join_pairs([
        match_points(state, visibility, points, labels, scale_m, observation.noise),
        match_vertices(state, visibility, observation, scale_m)]))
    measured, spread = merged_pairs(measured)
    parts = [measured]
    if config.free_space:
        parts.append(free_space_pairs(state, visibility, places))
    if observation.ground is not None:
        parts.append(ground_pairs(state, observation.ground, observation.lifted))
    return SurfaceTerms(join_pairs(parts), len(measured.vertex), of_limb, spread)
