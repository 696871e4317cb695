"""Synthetic RGB-D scenes of people behind things, with everything known about them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int8

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.errors import PopError
from pop_core.estimate import JointState
from pop_core.geometry.transform import invert_transform, transform_points
from pop_core.keypoints.detection import Detection
from pop_core.rendering.depth_renderer import RenderedDepth, render_depth
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.blocks import Surface, Texture, block_surface
from pop_core.synthesis.keypoints import KeypointNoise, noisy_detection
from pop_core.synthesis.layouts import Layout, SceneConfig, draw_layout
from pop_core.synthesis.people import moved_parameters
from pop_core.synthesis.rooms import room_surfaces
from pop_core.synthesis.sensor_noise import SENSORS
from pop_core.synthesis.shading import Stage, joined, shade
from pop_core.synthesis.visibility import joint_states, shared_states

ATTEMPTS = 200
DARK_BRIGHTNESS = 60  # mean colour below which active light comes back weak
MIN_VISIBLE = 5


class SceneError(PopError):
    """A scene configuration that nothing drawn satisfies."""


@dataclass(frozen=True, slots=True, eq=False)
class PersonTruth:
    """Everything known about one person of a scene; camera frame, metres.

    Args:
        parameters: SMPL parameters.
        joints: Joint centres.
        shared_points: The 15 points that detectors see.
        vertices: Unclothed mesh.
        clothed_vertices: The surface that the sensor sees.
        joint_state: A JointState per joint, by true geometry.
        shared_state: A JointState per shared point.
        mask: Pixels that show this person.
        amodal_mask: Pixels that would, with nothing else there.
        amodal_box_px: Box of the amodal mask (left, top, right, bottom).
        kind: Kind of the pose.
        clothes_m: Mean distance of cloth and hair from the skin; 0 for the unclothed.
    """

    parameters: BodyParameters
    joints: Float[np.ndarray, '24 3']
    shared_points: Float[np.ndarray, '15 3']
    vertices: Float[np.ndarray, 'v 3']
    clothed_vertices: Float[np.ndarray, 'v 3']
    joint_state: Int[np.ndarray, '24']
    shared_state: Int[np.ndarray, '15']
    mask: Bool[np.ndarray, 'h w']
    amodal_mask: Bool[np.ndarray, 'h w']
    amodal_box_px: Float[np.ndarray, '4']
    kind: str
    clothes_m: float

    @property
    def hidden_share(self) -> float:
        """Return the share of the shared points that the camera does not see."""
        return float((self.shared_state != JointState.VISIBLE).mean())


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
            return photograph(model, layout, truth, sensor, seed)
    raise SceneError(f'seed {seed}: expected a scene within {chosen}, found none in {ATTEMPTS}')


@dataclass(frozen=True, slots=True, eq=False)
class RenderedTruth:
    """Depth, owner of each pixel and people of a layout, before sensor noise.

    Args:
        surroundings: Room and blocks, joined, camera frame.
        depth_m: Depth of all [m]; +inf where nothing is.
        owner: Index of the person at each pixel, -1 for the surroundings.
        face: Triangle seen, of the surroundings or of the owner's body.
        people: Truth per person.
        part_labels: Joint that moves the surface seen, -1 where no person is.
    """

    surroundings: Stage
    depth_m: Float32[np.ndarray, 'h w']
    owner: Int8[np.ndarray, 'h w']
    face: Int[np.ndarray, 'h w']
    people: tuple[PersonTruth, ...]
    part_labels: Int8[np.ndarray, 'h w']


def render_truth(model: BodyModel, layout: Layout) -> RenderedTruth:
    """Return the truth of a layout: each person rendered alone, then against all others."""
    surfaces = [*room_surfaces(layout.room), *(block_surface(block) for block in layout.blocks)]
    stage = joined([_seen(surface, layout.T_camera_room) for surface in surfaces])
    background = render_depth(stage.vertices, stage.faces, layout.camera)
    clothed = [transform_points(layout.T_camera_room, actor.surface) for actor in layout.actors]
    alone = [render_depth(p, model.f, layout.camera) for p in clothed]
    layers = np.stack([background.depth_m, *(image.depth_m for image in alone)])
    owner = layers.argmin(axis=0)
    faces = np.stack([background.face, *(image.face for image in alone)])
    face = np.take_along_axis(faces, owner[None], axis=0)[0].astype(np.int32)
    part_of_face = np.append(_part_of_face(model), -1)  # face -1 is no part
    own_parts = [part_of_face[image.face] for image in alone]
    people = tuple(
        _person(model, layout, k, clothed[k], alone[k], own_parts[k], layers)
        for k in range(len(layout.actors)))
    empty = np.full_like(background.face, -1)
    parts = np.take_along_axis(np.stack([empty, *own_parts]), owner[None], axis=0)[0]
    return RenderedTruth(
        stage, layers.min(axis=0), (owner - 1).astype(np.int8), face, people,
        parts.astype(np.int8))


def photograph(
    model: BodyModel, layout: Layout, truth: RenderedTruth, sensor: str, seed: int,
    stamp_ns: int | None = None,
) -> SyntheticScene:
    """Return the scene as a sensor sees it: colours, and depth with the sensor's noise."""
    rng = np.random.default_rng([seed, 2])
    stage, rendered = _whole_stage(model, layout, truth)
    rgb = shade(stage, rendered, layout.camera, invert_transform(layout.T_camera_room),
                layout.light_room, rng)
    depth_m = np.where(np.isfinite(truth.depth_m), truth.depth_m, np.nan).astype(np.float32)
    if sensor:
        dark = _dark(rgb, truth.owner)
        depth_m = SENSORS[sensor](truth.depth_m, layout.camera, dark, rng)
    stamp = (1_000_000 + seed) * 1_000_000 if stamp_ns is None else stamp_ns
    frame = RgbdFrame(rgb, depth_m, layout.camera, stamp)
    return SyntheticScene(frame, truth.people, truth.depth_m, truth.part_labels, sensor,
                          layout.T_camera_room, seed)


def _person(
    model: BodyModel, layout: Layout, index: int, clothed: Float[np.ndarray, 'v 3'],
    alone: RenderedDepth, own_part: Int[np.ndarray, 'h w'], layers: Float32[np.ndarray, 'p h w'],
) -> PersonTruth:
    actor = layout.actors[index]
    parameters = moved_parameters(model, actor.parameters, layout.T_camera_room)
    p = joints(model, parameters)
    shared = attached_positions(shared_points(model), model, parameters)
    others = np.delete(layers, index + 1, axis=0).min(axis=0)
    states = joint_states(p, alone.depth_m, own_part, others, layout.camera)
    nose = shared[SHARED_INDEX['head']]
    mask = alone.covered & (alone.depth_m <= others)
    return PersonTruth(
        parameters=parameters, joints=p, shared_points=shared,
        vertices=transform_points(layout.T_camera_room, actor.skin), clothed_vertices=clothed,
        joint_state=states,
        shared_state=shared_states(states, nose, alone.depth_m, others, layout.camera),
        mask=mask, amodal_mask=alone.covered, amodal_box_px=_box(alone.covered), kind=actor.kind,
        clothes_m=float(actor.outfit.displacement_m.mean()),
    )


def _acceptable(people: tuple[PersonTruth, ...], config: SceneConfig) -> bool:
    """Return whether every person can be found and the most hidden one is hidden as wanted."""
    enough = all((p.shared_state == JointState.VISIBLE).sum() >= MIN_VISIBLE for p in people)
    if not people:
        return True
    hidden = max(p.hidden_share for p in people)
    return enough and config.hidden_share[0] <= hidden <= config.hidden_share[1]


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


def _seen(surface: Surface, T_camera_room: Float[np.ndarray, '4 4']) -> Surface:
    return Surface(transform_points(T_camera_room, surface.vertices), surface.faces,
                   surface.albedo, surface.texture)


def _part_of_face(model: BodyModel) -> Int[np.ndarray, 'm']:
    """Return the joint that moves each triangle most."""
    summed = model.weights[model.f].sum(axis=1)
    return summed.argmax(axis=1)


def _dark(rgb: np.ndarray, owner: Int8[np.ndarray, 'h w']) -> Bool[np.ndarray, 'h w']:
    """Return pixels of people whose cloth or hair returns little light."""
    return (rgb.mean(axis=2) < DARK_BRIGHTNESS) & (owner >= 0)


def _box(mask: Bool[np.ndarray, 'h w']) -> Float[np.ndarray, '4']:
    v, u = np.nonzero(mask)
    if len(u) == 0:
        return np.zeros(4)
    return np.array([u.min(), v.min(), u.max(), v.max()], dtype=np.float64)
