"""What three kinds of depth sensor make of a perfect depth image.

Depths are along z [m]; +inf or NaN in means nothing there, NaN out means no measurement.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from pop_core.geometry.camera import Camera

Depth = Float32[np.ndarray, 'h w']
BASELINE_M = 0.075      # projector to camera of structured light (Kinect v1)
STEREO_BASELINE_M = 0.05


def structured_light(
    depth_m: Depth, camera: Camera, dark: Bool[np.ndarray, 'h w'], rng: np.random.Generator
) -> Depth:
    """Return depth as a Kinect v1 measures it.

    Noise of 1.2 mm + 1.9 mm (z - 0.4)^2 (Nguyen, Izadi, Lovell 2012), disparity in steps of an
    eighth of a pixel, a shadow beside near objects where the projector's light does not reach,
    ragged edges.
    """
    z = jittered_pixels(_finite(depth_m), 0.5, rng)
    shadow = projector_shadow(_finite(depth_m), camera)
    z = z + rng.normal(0, 1, z.shape) * (0.0012 + 0.0019 * (z - 0.4) ** 2)
    focal_baseline = camera.fx * BASELINE_M
    disparity = np.round(focal_baseline / z * 8) / 8
    z = focal_baseline / np.maximum(disparity, 0.125)
    lost = shadow | grazing(depth_m, 0.12) | (z < 0.45) | (z > 7.0)
    lost |= dark & (rng.random(z.shape) < 0.15) | speckle(z.shape, 0.0003, rng)
    return _with_holes(z, lost)


def stereo(
    depth_m: Depth, camera: Camera, dark: Bool[np.ndarray, 'h w'], rng: np.random.Generator
) -> Depth:
    """Return depth as an active stereo camera (RealSense D435) measures it.

    Errors grow with z^2 and come in blotches, near objects are fattened by the matching window,
    holes open where nothing matches.
    """
    z = _finite(depth_m)
    window = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    fattened = cv2.erode(z, window)
    z = np.where(blotches(z.shape, 10, rng) > 0.0, fattened, z)
    sigma = 0.08 / (camera.fx * STEREO_BASELINE_M) * z**2  # 0.08 px of disparity
    z = z + sigma * (0.9 * blotches(z.shape, 7, rng) + 0.4 * rng.normal(0, 1, z.shape))
    z = cv2.GaussianBlur(z, (3, 3), 0.8)
    unmatched = grazing(depth_m, 0.2) & (rng.random(z.shape) < 0.5)
    holes = unmatched | (blotches(z.shape, 14, rng) + 0.5 * blotches(z.shape, 5, rng) > 2.9)
    lost = holes | (z < 0.28) | (z > 9.0) | (dark & (rng.random(z.shape) < 0.05))
    return _with_holes(z, lost)


def time_of_flight(
    depth_m: Depth, camera: Camera, dark: Bool[np.ndarray, 'h w'], rng: np.random.Generator
) -> Depth:
    """Return depth as a time-of-flight camera (Azure Kinect) measures it.

    Small noise, pixels that fly between near and far surfaces, a smooth multipath error of a
    centimetre, dark cloth and hair lost with distance.
    """
    z = _finite(depth_m)
    mixed = cv2.GaussianBlur(z, (3, 3), 0.7)
    edge = np.abs(mixed - z) > 0.02 * z
    z = np.where(edge & (rng.random(z.shape) < 0.7), mixed, z)
    multipath = 0.004 * blotches(z.shape, 60, rng) + 0.002 * z
    z = z + multipath + rng.normal(0, 1, z.shape) * (0.0012 + 0.0006 * z**2)
    weak = dark * np.clip(0.1 * z - 0.15, 0, 0.6)
    lost = (edge & (rng.random(z.shape) < 0.25)) | (rng.random(z.shape) < weak)
    lost |= (z < 0.25) | (z > 5.5 * (camera.fx / camera.width) / 0.78 + 1.0)
    return _with_holes(z, lost | grazing(depth_m, 0.08))


SENSORS: dict[str, Callable[[Depth, Camera, Bool[np.ndarray, 'h w'], np.random.Generator], Depth]]
SENSORS = {
    'structured_light': structured_light, 'stereo': stereo, 'time_of_flight': time_of_flight,
}
FAR_M = 50.0


def _finite(depth_m: Depth) -> Depth:
    return np.where(np.isfinite(depth_m), depth_m, FAR_M).astype(np.float32)


def _with_holes(z: Float[np.ndarray, 'h w'], lost: Bool[np.ndarray, 'h w']) -> Depth:
    return np.where(lost, np.nan, z).astype(np.float32)


def jittered_pixels(z: Depth, sigma_px: float, rng: np.random.Generator) -> Depth:
    """Return each pixel's depth read a little beside it: edges become ragged."""
    v, u = np.mgrid[: z.shape[0], : z.shape[1]].astype(np.float32)
    shift = rng.normal(0, sigma_px, (2, *z.shape)).astype(np.float32)
    return cv2.remap(z, u + shift[0], v + shift[1], cv2.INTER_NEAREST,
                     borderMode=cv2.BORDER_REPLICATE)


def projector_shadow(z: Depth, camera: Camera) -> Bool[np.ndarray, 'h w']:
    """Return pixels whose surface the projector, to the right of the camera, does not see.

    Along a row the projector sees columns u - f b / z; where a nearer surface on the projector's
    side has covered a column already, the light does not pass.
    """
    u = np.arange(z.shape[1])
    column = u - camera.fx * BASELINE_M / z
    from_right = np.minimum.accumulate(column[:, ::-1], axis=1)[:, ::-1]
    beyond = np.pad(from_right[:, 1:], ((0, 0), (0, 1)), constant_values=np.inf)
    return column > beyond + 1.0


def grazing(depth_m: Depth, least_cosine: float) -> Bool[np.ndarray, 'h w']:
    """Return pixels whose surface is seen nearly edge-on, from the slope of depth."""
    z = _finite(depth_m)
    slope_u = cv2.Sobel(z, cv2.CV_32F, 1, 0, ksize=3) / 8
    slope_v = cv2.Sobel(z, cv2.CV_32F, 0, 1, ksize=3) / 8
    slope = np.hypot(slope_u, slope_v) * z.shape[1] / np.maximum(z, 0.1)
    jump = cv2.dilate(z, np.ones((3, 3))) - cv2.erode(z, np.ones((3, 3))) > 0.15 * z
    return (1.0 / np.sqrt(1.0 + slope**2) < least_cosine) & ~jump


def blotches(
    shape: tuple[int, ...], size_px: int, rng: np.random.Generator
) -> Float[np.ndarray, 'h w']:
    """Return smooth noise of unit variance with spots of about `size_px`."""
    coarse = rng.normal(size=(shape[0] // size_px + 3, shape[1] // size_px + 3))
    fine = cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return fine / max(float(fine.std()), 1e-6)


def speckle(
    shape: tuple[int, ...], share: float, rng: np.random.Generator
) -> Bool[np.ndarray, 'h w']:
    """Return spots of 3x3 pixels around a share of all pixels."""
    seeds = (rng.random(shape) < share).astype(np.uint8)
    return cv2.dilate(seeds, np.ones((3, 3), np.uint8)) > 0
