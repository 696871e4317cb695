"""Sensor noise of training images: kinds and strengths mixed beyond any one sensor.

The network sees images resampled to few pixels, so noise is made at that size with the strength
that the sensor's own, finer pixels have; spots and borders keep their angle. Depth along z [m];
+inf in and NaN out mean nothing.
"""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from pop_core.geometry.camera import Camera
from pop_core.synthesis.sensor_noise import (
    BASELINE_M,
    FAR_M,
    STEREO_BASELINE_M,
    blotches,
    grazing,
    jittered_pixels,
    projector_shadow,
    speckle,
)

Depth = Float32[np.ndarray, 'h w']
Mask = Bool[np.ndarray, 'h w']
NATIVE_PX = (320.0, 720.0)  # focal length of sensors
GRAIN_PX = 160.0  # focal length of images in whose pixels sizes of spots are given below
KINDS = {'structured_light': 0.36, 'stereo': 0.34, 'time_of_flight': 0.22, 'clean': 0.08}


def degraded(depth_m: Depth, camera: Camera, dark: Mask, rng: np.random.Generator) -> Depth:
    """Return depth as some sensor might measure it.

    Args:
        depth_m: True depth.
        camera: Camera of the small image.
        dark: Pixels that return little light.
        rng: Randomness.
    """
    z = np.where(np.isfinite(depth_m), depth_m, np.float32(FAR_M))
    native_fx, grain = rng.uniform(*NATIVE_PX), camera.fx / GRAIN_PX
    kind = rng.choice(list(KINDS), p=list(KINDS.values()))
    lost = np.zeros(z.shape, dtype=bool)
    if kind == 'structured_light':
        z, lost = _structured_light(z, camera, native_fx, rng)
    elif kind == 'stereo':
        z, lost = _stereo(z, native_fx, grain, rng)
    elif kind == 'time_of_flight':
        z, lost = _time_of_flight(z, grain, rng)
    lost |= grazing(z, rng.uniform(0.0, 0.15))
    lost |= dark & (rng.random(z.shape, dtype=np.float32) < rng.uniform(0.0, 0.5))
    lost |= _more_holes(z.shape, grain, rng)
    lost |= (z < rng.uniform(0.2, 0.6)) | (z > rng.uniform(4.0, 11.0))
    z = z * np.float32(rng.normal(1.0, 0.008))
    measured = np.where(lost, np.float32(np.nan), z)
    return _filled(measured) if rng.random() < 0.12 else measured


def _structured_light(
    z: Depth, camera: Camera, native_fx: float, rng: np.random.Generator
) -> tuple[Depth, Mask]:
    """Return as `sensor_noise.structured_light`, with steps of the sensor's own pixels."""
    lost = projector_shadow(z, camera) if rng.random() < 0.8 else np.zeros(z.shape, dtype=bool)
    z = jittered_pixels(z, rng.uniform(0.1, 0.5), rng)
    z = z + _white(z.shape, rng) * (0.0012 + 0.0019 * (z - 0.4) ** 2) * rng.uniform(0.5, 1.5)
    focal_baseline = np.float32(native_fx * BASELINE_M)
    disparity = np.maximum(np.round(focal_baseline / np.maximum(z, 0.1) * 8) / 8, 0.125)
    return focal_baseline / disparity, lost | speckle(z.shape, 0.0004, rng)


def _stereo(
    z: Depth, native_fx: float, grain: float, rng: np.random.Generator
) -> tuple[Depth, Mask]:
    """Return as `sensor_noise.stereo`, up to depth so smoothed that limbs hardly stand out."""
    side = 2 * round(grain) + 1
    fat = cv2.erode(z, np.ones((side, side), np.uint8))
    z = np.where(blotches(z.shape, _px(5, grain), rng) > rng.uniform(0.0, 1.5), fat, z)
    sigma = np.float32(rng.uniform(0.04, 0.12) / (native_fx * STEREO_BASELINE_M)) * z**2
    spots = blotches(z.shape, _px(int(rng.integers(3, 8)), grain), rng)
    z = z + sigma * (spots + 0.3 * _white(z.shape, rng))
    if rng.random() < 0.6:
        z = cv2.GaussianBlur(z, (0, 0), rng.uniform(0.4, 1.6) * grain)
    field = blotches(z.shape, _px(8, grain), rng) + 0.5 * blotches(z.shape, _px(3, grain), rng)
    return z.astype(np.float32), field > rng.uniform(2.0, 4.0)


def _time_of_flight(z: Depth, grain: float, rng: np.random.Generator) -> tuple[Depth, Mask]:
    """Return as `sensor_noise.time_of_flight`: pixels that fly between two surfaces."""
    mixed = cv2.GaussianBlur(z, (3, 3), 0.6)
    edge = np.abs(mixed - z) > 0.02 * z
    chance = rng.random(z.shape, dtype=np.float32)
    z = np.where(edge & (chance < 0.4), mixed, z)
    multipath = 0.004 * blotches(z.shape, _px(30, grain), rng) + 0.002 * z
    z = z + multipath + _white(z.shape, rng) * (0.0012 + 0.0006 * z**2)
    return z.astype(np.float32), edge & (chance > rng.uniform(0.6, 1.0))


def _more_holes(shape: tuple[int, ...], grain: float, rng: np.random.Generator) -> Mask:
    """Return what registration and windows take away: a border, blobs, single pixels."""
    lost = np.zeros(shape, dtype=bool)
    if rng.random() < 0.4:
        top, left, bottom, right = (_px(k, grain) for k in rng.integers(0, 10, 4).tolist())
        lost[:top], lost[:, :left] = True, True
        lost[shape[0] - bottom:], lost[:, shape[1] - right:] = True, True
    if rng.random() < 0.25:
        lost |= blotches(shape, _px(int(rng.integers(12, 40)), grain), rng) > rng.uniform(1.2, 2.5)
    if rng.random() < 0.3:
        lost |= rng.random(shape, dtype=np.float32) < rng.uniform(0.0, 0.08)
    return lost


def _filled(z: Depth) -> Depth:
    """Return depth whose holes took the value to their left, as drivers' hole filling does."""
    known = np.isfinite(z)
    column = np.where(known, np.arange(z.shape[1]), 0)
    source = np.maximum.accumulate(column, axis=1)
    return np.take_along_axis(z, source, axis=1)


def _px(size: int, grain: float) -> int:
    """Return a size given in coarse pixels in those of the image."""
    return round(size * grain)


def _white(shape: tuple[int, ...], rng: np.random.Generator) -> Depth:
    return rng.standard_normal(shape, dtype=np.float32)
