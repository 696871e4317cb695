"""Synthetic RGB-D scenes of people behind things, with everything known about them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int8

from pop_core.body.model import BodyModel
from pop_core.errors import PopError
from pop_core.estimate import JointState
from pop_core.geometry.transform import invert_transform
from pop_core.keypoints.detection import Detection
from pop_core.rendering.depth_renderer import RenderedDepth
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.blocks import Surface, Texture
from pop_core.synthesis.keypoints import KeypointNoise, noisy_detection
from pop_core.synthesis.layouts import Layout, draw_layout
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.sensor_noise import SENSORS
from pop_core.synthesis.shading import Stage, joined, shade
from pop_core.synthesis.truth import PersonTruth, RenderedTruth, render_truth

ATTEMPTS = 200
DARK_ALBEDO = 0.12  # reflectance below which active light comes back weak


class SceneError(PopError):
    """A scene configuration that nothing drawn satisfies."""


@dataclass(frozen=True, slots=True, eq=False)
class SyntheticScene:
    """A frame and its truth.

    Args:
        frame: What the sensor delivers.
        people: Truth, in no order.
        true_depth_m: Depth without noise [m]; +inf where nothing is.
        part_labels: Joint that moves the person's surface at each pixel, -1 elsewhere.
        sensor: Name of the noise preset, '' for none.
        T_camera_room: Camera from room (y up, floor at y = 0).
        seed: What it was drawn from.
    """

    frame: RgbdFrame
    people: tuple[PersonTruth, ...]
    true_depth_m: Float32[np.ndarray, 'h w']
    part_labels: Int8[np.ndarray, 'h w']
    sensor: str
    T_camera_room: Float[np.ndarray, '4 4']
    seed: int

    def detections(self, noise: KeypointNoise | None = None) -> list[Detection | None]:
        """Return each person's keypoints with a detector's errors, the same ones at every call."""
        rng = np.random.default_rng([self.seed, 7])
        chosen = KeypointNoise() if noise is None else noise
        return [
            noisy_detection(p.shared_points, p.shared_state, self.frame.camera, rng, chosen)
            for p in self.people
        ]


def synthesise_scene(
    model: BodyModel, seed: int, config: SceneConfig | None = None
) -> SyntheticScene:
    """Return the scene of a seed: the same one every time.

    Raises:
        SceneError: If no drawn scene satisfies the configuration.
    """
    chosen = SceneConfig() if config is None else config
    rng = np.random.default_rng([seed, 1])
    for _ in range(ATTEMPTS):
        layout = draw_layout(model, chosen, rng)
        if layout is None:
            continue
        truth = render_truth(model, layout)
        if _acceptable(truth.people, chosen):
            sensor = str(rng.choice(chosen.sensors)) if chosen.sensors else ''
            return photograph(
                model, layout, truth, sensor=sensor, seed=seed, colour=chosen.colour)
    raise SceneError(f'seed {seed}: expected a scene within {chosen}, found none in {ATTEMPTS}')


def photograph(
    model: BodyModel, layout: Layout, truth: RenderedTruth, *, sensor: str, seed: int,
    stamp_ns: int | None = None, colour: bool = True,
) -> SyntheticScene:
    """Return the scene as a sensor sees it: depth with its noise, colours where asked for."""
    rng = np.random.default_rng([seed, 2])
    stage, rendered = _whole_stage(model, layout, truth)
    rgb = np.zeros((*rendered.face.shape, 3), dtype=np.uint8)
    if colour:
        rgb = shade(
            stage, rendered, layout.camera, light_room=layout.light_room, rng=rng,
            T_room_camera=invert_transform(layout.T_camera_room))
    depth_m = np.where(np.isfinite(truth.depth_m), truth.depth_m, np.nan).astype(np.float32)
    if sensor:
        dark = _dark(stage, rendered, truth.owner)
        depth_m = SENSORS[sensor](truth.depth_m, layout.camera, dark, rng)
    stamp = (1_000_000 + seed) * 1_000_000 if stamp_ns is None else stamp_ns
    frame = RgbdFrame(rgb, depth_m, layout.camera, stamp)
    return SyntheticScene(frame, truth.people, truth.depth_m, truth.part_labels, sensor,
                          layout.T_camera_room, seed)


def _acceptable(people: tuple[PersonTruth, ...], config: SceneConfig) -> bool:
    """Return whether every person can be found and the most hidden one is hidden as wanted."""
    if not people:
        return True
    fewest = min((p.shared_state == JointState.VISIBLE).sum() for p in people)
    hidden = max(p.hidden_share for p in people)
    low, high = config.hidden_share
    return bool(fewest >= config.fewest_visible and low <= hidden <= high)


def _whole_stage(
    model: BodyModel, layout: Layout, truth: RenderedTruth
) -> tuple[Stage, RenderedDepth]:
    """Return room and people as one set of triangles, and which triangle each pixel shows."""
    bodies = [
        Surface(person.clothed_vertices, model.f, actor.outfit.albedo)
        for person, actor in zip(truth.people, layout.actors, strict=True)
    ]
    base = truth.surroundings
    whole = joined([Surface(base.vertices, base.faces, base.albedo), *bodies])
    texture = np.concatenate(
        [base.texture, np.full(len(whole.faces) - len(base.faces), int(Texture.PLAIN))])
    start = np.array([0, *(len(base.faces) + k * len(model.f) for k in range(len(bodies)))])
    face = np.where(truth.face >= 0, truth.face + start[truth.owner + 1], -1).astype(np.int32)
    stage = Stage(whole.vertices, whole.faces, whole.albedo, texture)
    return stage, RenderedDepth(truth.depth_m, face)


def _dark(
    stage: Stage, rendered: RenderedDepth, owner: Int8[np.ndarray, 'h w']
) -> Bool[np.ndarray, 'h w']:
    """Return pixels of people whose cloth or hair returns little light."""
    albedo = stage.albedo[stage.faces].mean(axis=(1, 2))
    return (albedo < DARK_ALBEDO)[rendered.face] & (owner >= 0)
