"""How noisy a depth image is, told by the image itself.

Sensors that triangulate (structured light, stereo) err by a constant part of a pixel of disparity,
so by a multiple of z^2 in depth. Inverse depth is linear in the pixel on every plane: its second
difference there is noise alone, and planes fill most of most images.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32

from pop_core.geometry.camera import USUAL_FOCAL_PX

# At USUAL_FOCAL_PX: further apart than the spots of noise that stereo makes are wide, and every so
# many are enough. Depth aligned to a finer colour image repeats its pixels.
LAG_PX, STEP_PX = 6.0, 3.0
LEAST_LAG_PX = 3
LEAST_SAMPLES = 200
BASE_M = 0.0012  # no sensor is better than this at any distance
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True, slots=True)
class DepthNoise:
    """Standard deviation of measured depth.

    Args:
        per_m: Growth with the square of depth [1/m]; the default is a Kinect's at 3 m (Nguyen,
            Izadi and Lovell 2012).
    """

    per_m: float = 0.0015

    def sigma_m(self, depth_m: Float[np.ndarray, '*n']) -> Float[np.ndarray, '*n']:
        """Return the standard deviation at depths [m]."""
        return BASE_M + self.per_m * depth_m**2


USUAL_NOISE = DepthNoise()


def estimate_depth_noise(depth_m: Float32[np.ndarray, 'h w'], focal_px: float) -> DepthNoise:
    """Return the noise of a depth image; the usual one where too little was measured.

    Args:
        depth_m: Depth [m], NaN where nothing was measured.
        focal_px: Focal length of the image.
    """
    finer = focal_px / USUAL_FOCAL_PX
    lag, step = max(round(LAG_PX * finer), LEAST_LAG_PX), max(round(STEP_PX * finer), 1)
    bends = np.concatenate([_bends(depth_m, lag, step), _bends(depth_m.T, lag, step)])
    bends = bends[np.isfinite(bends)]
    if len(bends) < LEAST_SAMPLES:
        return USUAL_NOISE
    # Three independent samples of weights 1, -2, 1.
    return DepthNoise(float(MAD_TO_SIGMA * np.median(np.abs(bends)) / np.sqrt(6.0)))


def _bends(
    depth_m: Float32[np.ndarray, 'h w'], lag: int, step: int
) -> Float32[np.ndarray, 'n']:
    """Return second differences of inverse depth along rows; NaN where one is missing."""
    end = max(depth_m.shape[1] - 2 * lag, 0)
    before, here, after = (
        _inverse(depth_m[::step, k: end + k: step]) for k in (0, lag, 2 * lag))
    return (before - 2.0 * here + after).reshape(-1)


def _inverse(depth_m: Float32[np.ndarray, 'h w']) -> Float32[np.ndarray, 'h w']:
    with np.errstate(divide='ignore', invalid='ignore'):
        return np.where(depth_m > 0, 1.0 / depth_m, np.float32(np.nan))
