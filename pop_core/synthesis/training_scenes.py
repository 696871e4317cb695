"""Many small depth images of people, with the truth that a detector learns from.

The same bodies, clothes, furniture, rooms and truth as `synthesise_scene`; what differs is the
price: coarse meshes, rays instead of triangles for all that is not a body, people who appear in
several scenes, no colours. Camera frame, metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Int8

from pop_core.body.joints import SHARED_INDEX
from pop_core.body.kinematics import attached_positions, joints
from pop_core.body.model import BodyModel, shared_points
from pop_core.estimate import JointState
from pop_core.geometry.camera import Camera
from pop_core.geometry.transform import transform_points
from pop_core.rendering.depth_renderer import RenderedDepth, render_depth
from pop_core.rendering.joint_visibility import joint_states, shared_states
from pop_core.synthesis.layouts import Layout
from pop_core.synthesis.people import Actor, moved_parameters
from pop_core.synthesis.ray_casting import cast_rays
from pop_core.synthesis.training_layouts import draw_training_layout
from pop_core.synthesis.training_sensor import degraded
from pop_core.synthesis.troupe import Troupe
from pop_core.synthesis.truth import part_of_face

# A pixel that measures something else than what it shows (at edges, in filled holes) is nobody's.
STRAY_M, STRAY_SHARE = 0.08, 0.05
DARK_PARTS = 0.15  # share of body parts in dark cloth, and of heads with dark hair


@dataclass(frozen=True, slots=True, eq=False)
class TrainingPerson:
    """What a detector is to say about one person.

    Args:
        shared_points: The 15 points, camera frame [m]; hidden ones too.
        shared_state: A JointState per point.
    """

    shared_points: Float[np.ndarray, '15 3']
    shared_state: Int[np.ndarray, '15']

    @property
    def visible(self) -> Bool[np.ndarray, '15']:
        """Return which of the points the camera sees."""
        return np.asarray(self.shared_state == JointState.VISIBLE)


@dataclass(frozen=True, slots=True, eq=False)
class TrainingScene:
    """A depth image and its truth.

    Args:
        depth_m: What the sensor measures, NaN where nothing.
        owner: Index of the person at each pixel, -1 for the surroundings.
        part_labels: Joint that moves the surface at each pixel, -1 for the surroundings.
        people: Truth per person, also of those wholly hidden.
        camera: Camera without distortion.
    """

    depth_m: Float32[np.ndarray, 'h w']
    owner: Int8[np.ndarray, 'h w']
    part_labels: Int8[np.ndarray, 'h w']
    people: tuple[TrainingPerson, ...]
    camera: Camera


class TrainingScenes:
    """The stream of scenes of a seed."""

    def __init__(
        self, model: BodyModel, seed: int, *, width: int = 192, height: int = 160,
        focal_px: float = 160.0, motions: Sequence[Float[np.ndarray, '23 3']] = (),
    ) -> None:
        """Prepare to draw.

        Args:
            model: Body; `coarse_body` of one makes scenes cheap.
            seed: Decides every scene of the stream.
            width: Width of the images [px].
            height: Height of the images [px].
            focal_px: Focal length [px], that of the network's input.
            motions: Captured poses to draw from as well.
        """
        self.model = model
        self.size = (width, height)
        self.focal_px = focal_px
        self.troupe = Troupe(model, motions=motions)
        self._rng = np.random.default_rng([seed, 11])
        self._part_of_face = np.append(part_of_face(model), -1)  # face -1 is no part

    def draw(self) -> TrainingScene:
        """Return the next scene."""
        rng = self._rng
        layout = draw_training_layout(self.troupe, self.size, self.focal_px, rng)
        surroundings_m = cast_rays(
            layout.room, layout.blocks, layout.camera, layout.T_camera_room)
        alone = [self._alone(actor, layout) for actor in layout.actors]
        layers = np.stack([surroundings_m, *(image.depth_m for image in alone)])
        owner = layers.argmin(axis=0).astype(np.int8) - np.int8(1)
        parts = np.full(owner.shape, -1, dtype=np.int8)
        for k, image in enumerate(alone):
            parts = np.where(owner == k, self._part_of_face[image.face], parts).astype(np.int8)
        people = tuple(
            self._person(actor, layout, alone[k], np.delete(layers, k + 1, axis=0).min(axis=0))
            for k, actor in enumerate(layout.actors))
        dark = _dark(owner, parts, len(people), rng)
        true_m = layers.min(axis=0)
        depth_m = degraded(true_m, layout.camera, dark, rng)
        with np.errstate(invalid='ignore'):
            elsewhere = np.abs(depth_m - true_m) > STRAY_M + STRAY_SHARE * true_m
        owner[elsewhere], parts[elsewhere] = -1, -1
        return TrainingScene(depth_m, owner, parts, people, layout.camera)

    def _alone(self, actor: Actor, layout: Layout) -> RenderedDepth:
        surface = transform_points(layout.T_camera_room, actor.surface)
        return render_depth(surface, self.model.f, layout.camera)

    def _person(
        self, actor: Actor, layout: Layout, alone: RenderedDepth,
        others_m: Float32[np.ndarray, 'h w'],
    ) -> TrainingPerson:
        parameters = moved_parameters(self.model, actor.parameters, layout.T_camera_room)
        p = joints(self.model, parameters)
        shared = attached_positions(shared_points(self.model), self.model, parameters)
        part = self._part_of_face[alone.face]
        states = joint_states(p, alone.depth_m, part, others_m, layout.camera)
        nose = shared[SHARED_INDEX['head']]
        return TrainingPerson(
            shared, shared_states(states, nose, alone.depth_m, others_m, layout.camera))


def _dark(
    owner: Int8[np.ndarray, 'h w'], parts: Int8[np.ndarray, 'h w'], n_people: int,
    rng: np.random.Generator,
) -> Bool[np.ndarray, 'h w']:
    """Return the pixels of body parts drawn to return little light."""
    dark = rng.random((n_people + 1, 25)) < DARK_PARTS
    dark[-1] = False  # row -1 is the surroundings
    return dark[owner, parts]
