"""What is known about a scene before a sensor spoils it; camera frame, metres."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int8

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, BodyParameters, shared_points
from pop_core.estimate import JointState
from pop_core.geometry.transform import transform_points
from pop_core.rendering.depth_renderer import RenderedDepth, render_depth
from pop_core.rendering.joint_visibility import joint_states, shared_states
from pop_core.synthesis.blocks import Surface, block_surface
from pop_core.synthesis.layouts import Layout
from pop_core.synthesis.people import moved_parameters
from pop_core.synthesis.rooms import room_surfaces
from pop_core.synthesis.shading import Stage, joined


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


@dataclass(frozen=True, slots=True, eq=False)
class Background:
    """Room and blocks of a layout, camera frame, and what the camera sees of them."""

    stage: Stage
    image: RenderedDepth


def background_of(layout: Layout) -> Background:
    """Return a layout without its people."""
    surfaces = [*room_surfaces(layout.room), *(block_surface(block) for block in layout.blocks)]
    stage = joined([_seen(surface, layout.T_camera_room) for surface in surfaces])
    return Background(stage, render_depth(stage.vertices, stage.faces, layout.camera))


def render_truth(
    model: BodyModel, layout: Layout, behind: Background | None = None
) -> RenderedTruth:
    """Return the truth of a layout: each person rendered alone, then against all others.

    Args:
        model: Body model.
        layout: Who and what stands where.
        behind: The same layout's background, where it is known from an earlier frame.
    """
    behind = background_of(layout) if behind is None else behind
    stage, background = behind.stage, behind.image
    clothed = [transform_points(layout.T_camera_room, actor.surface) for actor in layout.actors]
    alone = [render_depth(p, model.f, layout.camera) for p in clothed]
    layers = np.stack([background.depth_m, *(image.depth_m for image in alone)])
    owner = layers.argmin(axis=0)
    faces = np.stack([background.face, *(image.face for image in alone)])
    face = np.take_along_axis(faces, owner[None], axis=0)[0].astype(np.int32)
    of_face = np.append(part_of_face(model), -1)  # face -1 is no part
    own_parts = [of_face[image.face] for image in alone]
    people = tuple(
        _person(model, layout, k, _Alone(clothed[k], alone[k], own_parts[k]), layers)
        for k in range(len(layout.actors)))
    empty = np.full_like(background.face, -1)
    parts = np.take_along_axis(np.stack([empty, *own_parts]), owner[None], axis=0)[0]
    return RenderedTruth(
        stage, layers.min(axis=0), (owner - 1).astype(np.int8), face, people,
        parts.astype(np.int8))


@dataclass(frozen=True, slots=True, eq=False)
class _Alone:
    """One person rendered with nothing else there."""

    clothed: Float[np.ndarray, 'v 3']
    image: RenderedDepth
    part: Int[np.ndarray, 'h w']


def _person(
    model: BodyModel, layout: Layout, index: int, alone: _Alone,
    layers: Float32[np.ndarray, 'p h w'],
) -> PersonTruth:
    actor = layout.actors[index]
    parameters = moved_parameters(model, actor.parameters, layout.T_camera_room)
    p = joints(model, parameters)
    shared = attached_positions(shared_points(model), model, parameters)
    others = np.delete(layers, index + 1, axis=0).min(axis=0)
    own_m = alone.image.depth_m
    states = joint_states(p, own_m, alone.part, others, layout.camera)
    nose = shared[SHARED_INDEX['head']]
    amodal = alone.image.covered
    return PersonTruth(
        parameters=parameters, joints=p, shared_points=shared,
        vertices=transform_points(layout.T_camera_room, actor.skin),
        clothed_vertices=alone.clothed,
        joint_state=states,
        shared_state=shared_states(states, nose, own_m, others, layout.camera),
        mask=amodal & (own_m <= others), amodal_mask=amodal, amodal_box_px=_box(amodal),
        kind=actor.kind,
        clothes_m=float(actor.outfit.displacement_m.mean()),
    )


def _seen(surface: Surface, T_camera_room: Float[np.ndarray, '4 4']) -> Surface:
    return Surface(transform_points(T_camera_room, surface.vertices), surface.faces,
                   surface.albedo, surface.texture)


@lru_cache(maxsize=4)
def part_of_face(model: BodyModel) -> Int[np.ndarray, 'm']:
    """Return the joint that moves each triangle most."""
    summed = model.weights[model.f].sum(axis=1)
    return summed.argmax(axis=1)


def _box(mask: Bool[np.ndarray, 'h w']) -> Float[np.ndarray, '4']:
    v, u = np.nonzero(mask)
    if len(u) == 0:
        return np.zeros(4)
    return np.array([u.min(), v.min(), u.max(), v.max()], dtype=np.float64)
