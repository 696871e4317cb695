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


@dataclass(frozen=True, slots=True, eq=False)
class KeypointDraws:
    """The random numbers of one detection: uniform in 0..1 unless called normal.

    Args:
        guess: Is a hidden point guessed?
        spread: How far do keypoints spread?
        offset: Normal; where to, in units of the spread.
        missing: Is a visible point missed?
        outlier: Is a visible point put elsewhere?
        elsewhere: Where, within what is seen of the person.
        swap: Are left and right taken for each other?
        high: Normal; score of seen points.
        low: Normal; score of guessed points.
    """

    guess: Float[np.ndarray, '15']
    spread: float
    offset: Float[np.ndarray, '15 2']
    missing: Float[np.ndarray, '15']
    outlier: Float[np.ndarray, '15']
    elsewhere: Float[np.ndarray, '15 2']
    swap: float
    high: Float[np.ndarray, '15']
    low: Float[np.ndarray, '15']


def draw_keypoint_errors(rng: np.random.Generator) -> KeypointDraws:
    """Return the numbers of one detection, drawn independently."""
    n = N_SHARED
    return KeypointDraws(
        guess=rng.random(n), spread=rng.random(), offset=rng.normal(size=(n, 2)),
        missing=rng.random(n), outlier=rng.random(n), elsewhere=rng.random((n, 2)),
        swap=rng.random(), high=rng.normal(size=n), low=rng.normal(size=n))


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
    return detection_from_draws(
        points_camera, states, camera, draw_keypoint_errors(rng), noise)


def detection_from_draws(
    points_camera: Float[np.ndarray, '15 3'], states: Int[np.ndarray, '15'], camera: Camera,
    draws: KeypointDraws, noise: KeypointNoise,
) -> Detection | None:
    """Return the detection that given random numbers make of a person, or None.

    Args:
        points_camera: The shared points, camera frame [m].
        states: A JointState per point.
        camera: Camera without distortion.
        draws: Randomness.
        noise: How the detector errs.
    """
    truth_px = np.nan_to_num(camera.project(points_camera), nan=-1e4)
    seen = states == JointState.VISIBLE
    guessed = draws.guess < _chance_of_guess(states, noise)
    low_px, high_px = noise.sigma_px
    sigma = (low_px + (high_px - low_px) * draws.spread) * camera.width / 640
    spread = np.where(guessed, sigma * noise.guess_factor, sigma)[:, None]
    keypoints = truth_px + draws.offset * spread
    found = (seen & (draws.missing >= noise.missing)) | guessed
    wrong = found & seen & (draws.outlier < noise.outliers)
    keypoints = _with_outliers(keypoints, truth_px[seen], wrong, draws.elsewhere)
    if draws.swap < noise.swaps:
        keypoints, found = keypoints[SHARED_MIRROR], found[SHARED_MIRROR]
    found &= _inside(keypoints, camera)
    if found.sum() < MIN_KEYPOINTS:
        return None
    high = np.clip(0.82 + 0.08 * draws.high, 0.3, 0.98)
    low = np.clip(0.35 + 0.12 * draws.low, 0.06, 0.7)
    scores = np.where(found, np.where(guessed, low, high), 0.0)
    return detection_of(keypoints, scores)


def _chance_of_guess(
    states: Int[np.ndarray, '15'], noise: KeypointNoise
) -> Float[np.ndarray, '15']:
    """Return how often the detector puts each hidden point somewhere all the same."""
    return np.select(
        [states == JointState.SELF_OCCLUDED, states == JointState.SCENE_OCCLUDED],
        [noise.hidden_by_self, noise.hidden_by_scene], 0.0)


def _with_outliers(
    keypoints: Float[np.ndarray, '15 2'], on_person: Float[np.ndarray, 'n 2'],
    wrong: Bool[np.ndarray, '15'], elsewhere: Float[np.ndarray, '15 2'],
) -> Float[np.ndarray, '15 2']:
    """Return keypoints of which some lie elsewhere in the box of what is seen of the person."""
    if len(on_person) == 0:
        return keypoints
    low, high = on_person.min(axis=0), on_person.max(axis=0) + 1.0
    return np.where(wrong[:, None], low + (high - low) * elsewhere, keypoints)


def _inside(
    keypoints: Float[np.ndarray, '15 2'], camera: Camera
) -> Bool[np.ndarray, '15']:
    last = [camera.width - 1, camera.height - 1]
    return np.all((keypoints >= 0) & (keypoints <= last), axis=1)

