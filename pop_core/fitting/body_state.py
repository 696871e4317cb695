"""A body at one point of the search: parameters and everything computed from them, once."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.capsules import BodyCapsules, body_capsules
from pop_core.body.joint_limits import pose_coordinates
from pop_core.body.joints import JOINT_INDEX
from pop_core.body.kinematics import (
    PosedSkeleton,
    attached_jacobian,
    attached_places,
    increment,
    pose_skeleton,
)
from pop_core.body.model import AttachedPoints, BodyModel, BodyParameters, shared_points
from pop_core.body.scalp import hair_share
from pop_core.body.skinning import SkinningSubset
from pop_core.rendering.depth_renderer import is_closed, vertex_normals

TRANSL = slice(0, 3)
GLOBAL_ORIENT = slice(3, 6)
BODY_POSE = slice(6, 75)
CLOTH_M = 0.006  # mean distance of a clothed surface from the skin
HAIR_M = 0.004  # the same of hair: between shaved and thick, mostly short
BARE = [JOINT_INDEX[name] for name in ('head', 'left_hand', 'right_hand')]
SOLE_M = 0.02  # vertices this close to the lowest of a foot belong to its sole


def betas_slice(n_betas: int) -> slice:
    """Return where the betas stand in the parameter vector."""
    return slice(75, 75 + n_betas)


class FitBody:
    """A model prepared for fitting: one mesh (coarse or full) and the shared landmarks."""

    def __init__(self, model: BodyModel, *, full: bool) -> None:
        """Prepare the coarse fitting mesh of a model, or the full output mesh."""
        self.model = model
        chosen = np.arange(len(model.v_template)) if full else model.fit_vertices
        self.skinning = SkinningSubset(model, None if full else model.fit_vertices)
        self.faces: Int[np.ndarray, 'm 3'] = model.f if full else model.fit_faces
        self.is_closed = is_closed(self.skinning.v_template, self.faces)
        self.landmarks: AttachedPoints = shared_points(model)
        self.capsules: BodyCapsules = body_capsules(model)
        self.size = 3 + 72 + model.n_betas + 1
        self.main_bone: Int[np.ndarray, 'n'] = self.skinning.bone_ids[:, 0]
        self.cloth_m = np.where(
            np.isin(self.main_bone, BARE), HAIR_M * hair_share(model)[chosen], CLOTH_M)
        self._faces_without: dict[tuple[int, ...], Int[np.ndarray, 'k 3']] = {}
        self.soles = (self._sole('left'), self._sole('right'))

    def state(self, parameters: BodyParameters) -> BodyState:
        """Return the state of a set of parameters."""
        return BodyState(self, parameters)

    def faces_without(self, joints: tuple[int, ...]) -> Int[np.ndarray, 'k 3']:
        """Return the triangles that touch no vertex which moves mostly with one of the joints."""
        if joints not in self._faces_without:
            touching = np.isin(self.main_bone, joints)[self.faces].any(axis=1)
            self._faces_without[joints] = self.faces[~touching]
        return self._faces_without[joints]

    def _sole(self, side: str) -> Int[np.ndarray, 'n']:
        """Return the vertices under one foot."""
        rest_height = self.skinning.v_template[:, 1]
        foot = np.isin(
            self.main_bone, [JOINT_INDEX[f'{side}_ankle'], JOINT_INDEX[f'{side}_foot']])
        return np.flatnonzero(foot & (rest_height < rest_height[foot].min() + SOLE_M))


class BodyState:
    """Parameters with skeleton, vertices, normals and landmarks, each computed when first used."""

    def __init__(self, body: FitBody, parameters: BodyParameters) -> None:
        """Hold parameters of a prepared body."""
        self.body = body
        self.parameters = parameters

    @cached_property
    def skeleton(self) -> PosedSkeleton:
        """Return the posed tree."""
        return pose_skeleton(self.body.model, self.parameters)

    @cached_property
    def coordinates(self) -> Float[np.ndarray, '23 3']:
        """Return the swing-twist coordinates of the pose [rad]."""
        return pose_coordinates(self.parameters.body_pose)

    @cached_property
    def rest(self) -> Float[np.ndarray, 'n 3']:
        """Return the vertices of the shaped fitting mesh in T-pose [m], body frame."""
        return self.body.skinning.shaped(self.parameters, self.skeleton)

    @cached_property
    def vertices(self) -> Float[np.ndarray, 'n 3']:
        """Return the vertices of the fitting mesh [m], camera frame."""
        return self.body.skinning.posed(self.rest, self.parameters, self.skeleton)

    @cached_property
    def normals(self) -> Float[np.ndarray, 'n 3']:
        """Return outward unit normals of the vertices, camera frame."""
        return vertex_normals(self.vertices, self.body.faces)

    @cached_property
    def clothed(self) -> Float[np.ndarray, 'n 3']:
        """Return where clothes and hair lie over the vertices [m]: what a sensor sees."""
        return self.vertices + self.body.cloth_m[:, None] * self.normals

    @cached_property
    def joints(self) -> Float[np.ndarray, '24 3']:
        """Return the 24 joints [m], camera frame."""
        return self.parameters.scale * self.skeleton.p + self.parameters.transl

    @cached_property
    def landmarks(self) -> Float[np.ndarray, 's 3']:
        """Return the 15 shared points [m], camera frame."""
        parameters = self.parameters
        places = attached_places(self.body.landmarks, self.skeleton, parameters.betas)
        return parameters.scale * places + parameters.transl

    @cached_property
    def landmark_jacobian(self) -> Float[np.ndarray, 's 3 x']:
        """Return the derivative of the shared points."""
        body = self.body
        return attached_jacobian(body.landmarks, body.model, self.parameters, self.skeleton)

    def directional_jacobian(
        self, vertex: Int[np.ndarray, 'n'], direction: Float[np.ndarray, 'n 3']
    ) -> Float[np.ndarray, 'n x']:
        """Return the derivative of `direction . vertex` per row."""
        return self.body.skinning.directional_jacobian(
            self.rest, self.parameters, self.skeleton, vertex, direction)

    def moved(self, step: Float[np.ndarray, 'x']) -> BodyState:
        """Return the state after a step."""
        return BodyState(self.body, increment(self.parameters, step, self.skeleton))
