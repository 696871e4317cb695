"""The SMPL-like body model: arrays under their SMPL names, and the parameters that pose it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int

from pop_core.body.joints import JOINT_INDEX, N_JOINTS, SHARED
from pop_core.errors import ModelFileError

INFLUENCES = 4  # most bones that move one vertex, as in SMPL


@dataclass(frozen=True, slots=True, eq=False)
class BodyParameters:
    """SMPL parameters (Loper et al. 2015) in some outer frame, usually the camera's.

    Vertices are `scale * posed(betas, body_pose) + transl`, where the posed body's root joint
    stands at J_root(betas) and `global_orient` turns about it; with scale 1 this is SMPL.

    Args:
        transl: Translation [m].
        global_orient: Rotation vector of the root [rad], outer frame from body.
        body_pose: Rotation vectors of joints 1..23 relative to their parents [rad].
        betas: Shape coefficients [standard deviations].
        scale: Uniform scale, 1 for a body the shape space holds.
    """

    transl: Float[np.ndarray, '3']
    global_orient: Float[np.ndarray, '3']
    body_pose: Float[np.ndarray, '23 3']
    betas: Float[np.ndarray, 'b']
    scale: float = 1.0

    def replaced(self, **changes: object) -> BodyParameters:
        """Return a copy with some fields replaced."""
        return replace(self, **changes)  # type: ignore[arg-type]


def rest_parameters(n_betas: int = 10) -> BodyParameters:
    """Return the T-pose of the mean body at the origin of its own frame."""
    return BodyParameters(np.zeros(3), np.zeros(3), np.zeros((23, 3)), np.zeros(n_betas))


@dataclass(frozen=True, slots=True, eq=False)
class BodyModel:
    """A linear blend skinned body of 24 joints.

    Args:
        name: Short name, such as 'default'.
        v_template: T-pose of the mean body [m], y up, facing +z, the person's left is +x.
        shapedirs: Displacement per unit of each beta [m].
        posedirs: Pose-dependent displacement per entry of (R - I) of joints 1..23, or None.
        J_regressor: Joints as weighted sums of T-pose vertices.
        weights: Skinning weights; rows sum to one.
        parents: Parent of each joint, -1 for the root.
        f: Triangles, outward by the right hand rule.
        fit_vertices: Vertices that form the coarse mesh used while fitting.
        fit_faces: Triangles of the coarse mesh, indices into `fit_vertices`.

    Raises:
        ModelFileError: If shapes do not fit together.
    """

    name: str
    v_template: Float[np.ndarray, 'v 3']
    shapedirs: Float[np.ndarray, 'v 3 b']
    posedirs: Float[np.ndarray, 'v 3 p'] | None
    J_regressor: Float[np.ndarray, '24 v']
    weights: Float[np.ndarray, 'v 24']
    parents: Int[np.ndarray, '24']
    f: Int[np.ndarray, 'm 3']
    fit_vertices: Int[np.ndarray, 'n']
    fit_faces: Int[np.ndarray, 'k 3']
    # Derived once, so that no frame pays for it:
    joint_template: Float[np.ndarray, '24 3'] = field(init=False)
    joint_shapedirs: Float[np.ndarray, '24 3 b'] = field(init=False)
    bone_ids: Int[np.ndarray, 'v 4'] = field(init=False)
    bone_weights: Float[np.ndarray, 'v 4'] = field(init=False)
    nose_vertex: int = field(init=False)

    def __post_init__(self) -> None:
        n = len(self.v_template)
        shapes = (self.shapedirs.shape[:2], self.J_regressor.shape, self.weights.shape)
        if shapes != ((n, 3), (N_JOINTS, n), (n, N_JOINTS)):
            raise ModelFileError(
                f'{self.name}: expected shapedirs, J_regressor and weights of {n} vertices and '
                f'{N_JOINTS} joints, found {shapes}'
            )
        joint_shapedirs = np.einsum('jv,vcb->jcb', self.J_regressor, self.shapedirs)
        order = np.argsort(-self.weights, axis=1, kind='stable')[:, :INFLUENCES]
        largest = np.take_along_axis(self.weights, order, axis=1)
        derived = {
            'joint_template': self.J_regressor @ self.v_template,
            'joint_shapedirs': joint_shapedirs,
            'bone_ids': np.ascontiguousarray(order.astype(np.int64)),
            'bone_weights': largest / largest.sum(axis=1, keepdims=True),
            'nose_vertex': _nose_vertex(self.v_template, self.weights),
        }
        for name, value in derived.items():
            object.__setattr__(self, name, value)

    @property
    def n_betas(self) -> int:
        """Return the number of shape coefficients."""
        return self.shapedirs.shape[2]


@dataclass(frozen=True, slots=True, eq=False)
class AttachedPoints:
    """Points carried rigidly by one joint each: the joints themselves, and landmarks.

    Args:
        joint: Joint that carries each point.
        template: Rest position on the mean body [m].
        shapedirs: Rest displacement per unit of each beta [m].
    """

    joint: Int[np.ndarray, 'n']
    template: Float[np.ndarray, 'n 3']
    shapedirs: Float[np.ndarray, 'n 3 b']


def joint_points(model: BodyModel) -> AttachedPoints:
    """Return the 24 joints as attached points."""
    return AttachedPoints(np.arange(N_JOINTS), model.joint_template, model.joint_shapedirs)


def shared_points(model: BodyModel) -> AttachedPoints:
    """Return the 15 points that 2D detectors see: joints, and the nose for the head.

    Detectors mark the nose, which lies a hand's width in front of SMPL's head joint and turns
    with the head; comparing it with the joint itself would bend every neck.
    """
    template = model.joint_template[SHARED].copy()
    shapedirs = model.joint_shapedirs[SHARED].copy()
    head = int(np.flatnonzero(JOINT_INDEX['head'] == SHARED)[0])
    template[head] = model.v_template[model.nose_vertex]
    shapedirs[head] = model.shapedirs[model.nose_vertex]
    return AttachedPoints(SHARED.copy(), template, shapedirs)


def _nose_vertex(v_template: Float[np.ndarray, 'v 3'], weights: Float[np.ndarray, 'v 24']) -> int:
    """Return the foremost vertex of the head near the midline."""
    on_head = weights[:, JOINT_INDEX['head']] > 0.5
    central = np.abs(v_template[:, 0]) < 0.02
    allowed = on_head & central if np.any(on_head & central) else on_head
    return int(np.argmax(np.where(allowed, v_template[:, 2], -np.inf)))
