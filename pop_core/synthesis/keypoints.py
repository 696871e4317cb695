"""Keypoints as a 2D detector would give them, made from truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import N_SHARED, SHARED_MIRROR
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.people import detection_of

MIN_KEYPOINTS = 4


@dataclass(frozen=True, slots=True)
class KeypointNoise:
    """How a detector errs; pixel figures are for an image 640 pixels wide.

    Args:
        sigma_px: Lowest and highest spread of a person's keypoints [px].
        missing: Share of visible keypoints not found.
        outliers: Share of visible keypoints put somewhere else on the person.
        swaps: Share of people whose legs or arms are taken for each other.
        hidden_by_self: Share of keypoints found although the own body hides them.
        hidden_by_scene: Share of keypoints guessed although the scene hides them.
        guess_factor: Spread of guessed keypoints relative to seen ones.
    """

    sigma_px: tuple[float, float] = (3.0, 5.0)
    missing: float = 0.03
    outliers: float = 0.02
    swaps: float = 0.01
    hidden_by_self: float = 0.6
    hidden_by_scene: float = 0.2
    guess_factor: float = 3.0


def noisy_detection(
    points_camera: Float[np.ndarray, '15 3'], states: Int[np.ndarray, '15'], camera: Camera,
    rng: np.random.Generator, noise: KeypointNoise,
) -> Detection | None:
    """Return what a detector finds of a person, or None when it finds too little.

    Args:
        points_camera: The shared points, camera frame [m].
        states: A JointState per point.
        camera: Camera without distortion.
        rng: Randomness.
        noise: How the detector errs.
    """
    truth_px = np.nan_to_num(camera.project(points_camera), nan=-1e4)
    seen = states == JointState.VISIBLE
    guessed = _guesses(states, rng, noise)
    sigma = rng.uniform(*noise.sigma_px) * camera.width / 640
    spread = np.where(guessed, sigma * noise.guess_factor, sigma)[:, None]
    keypoints = truth_px + rng.normal(size=(N_SHARED, 2)) * spread
    found = (seen & (rng.random(N_SHARED) >= noise.missing)) | guessed
    keypoints = _with_outliers(keypoints, truth_px[seen], found & seen, rng, noise.outliers)
    if rng.random() < noise.swaps:
        keypoints, found = keypoints[SHARED_MIRROR], found[SHARED_MIRROR]
    found &= _inside(keypoints, camera)
    if found.sum() < MIN_KEYPOINTS:
        return None
    high = np.clip(rng.normal(0.82, 0.08, N_SHARED), 0.3, 0.98)
    low = np.clip(rng.normal(0.35, 0.12, N_SHARED), 0.06, 0.7)
    scores = np.where(found, np.where(guessed, low, high), 0.0)
    return detection_of(keypoints, scores)


def _guesses(
    states: Int[np.ndarray, '15'], rng: np.random.Generator, noise: KeypointNoise
) -> Bool[np.ndarray, '15']:
    """Return which hidden points the detector puts somewhere all the same."""
    chance = np.select(
        [states == JointState.SELF_OCCLUDED, states == JointState.SCENE_OCCLUDED],
        [noise.hidden_by_self, noise.hidden_by_scene], 0.0)
    return rng.random(N_SHARED) < chance


def _with_outliers(
    keypoints: Float[np.ndarray, '15 2'], on_person: Float[np.ndarray, 'n 2'],
    candidates: Bool[np.ndarray, '15'], rng: np.random.Generator, share: float,
) -> Float[np.ndarray, '15 2']:
    """Return keypoints of which some lie anywhere in the box of what is seen of the person."""
    if len(on_person) == 0:
        return keypoints
    wrong = candidates & (rng.random(N_SHARED) < share)
    anywhere = rng.uniform(on_person.min(axis=0), on_person.max(axis=0) + 1.0, (N_SHARED, 2))
    return np.where(wrong[:, None], anywhere, keypoints)


def _inside(
    keypoints: Float[np.ndarray, '15 2'], camera: Camera
) -> Bool[np.ndarray, '15']:
    last = [camera.width - 1, camera.height - 1]
    return np.all((keypoints >= 0) & (keypoints <= last), axis=1)

