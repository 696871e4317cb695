"""How far to trust a fit as a person fitted right, beside its agreement with depth."""

from __future__ import annotations

import numpy as np

from pop_core.fitting.body_fit import BodyFit
from pop_core.keypoints.lifted_joints import LiftedJoints

AGREES_M = 0.15  # of a lifted joint that the fit explains
# Norm of the first shape coefficients of nearly everyone, once fitted; further ones are noise.
COMMON_BETAS, FIRST_BETAS = 3.0, 10


def plausibility(fit: BodyFit, lifted: LiftedJoints) -> float:
    """Return a share 0..1: keypoints the body explains, times how common its shape is.

    Depth alone agrees with many wrong bodies: a person's jacket over a chair, say, or half a
    person whose other half was taken for somebody else's.
    """
    if fit.sides_exchanged:
        lifted = lifted.with_sides_exchanged()
    rows = lifted.lifted
    off_m = np.linalg.norm(fit.coarse.landmarks - lifted.positions_camera, axis=1)[rows]
    weight = lifted.scores[rows]
    explained = float(weight @ (off_m < AGREES_M) / max(float(weight.sum()), 1e-9))
    strange = max(0.0, float(np.linalg.norm(fit.parameters.betas[:FIRST_BETAS])) - COMMON_BETAS)
    return explained * float(np.exp(-0.5 * strange**2))
