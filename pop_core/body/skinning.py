"""Linear blend skinning of the whole mesh or of a subset of its vertices, and its Jacobian."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int

from pop_core.body import skinning_kernels as kernels
from pop_core.body.kinematics import PosedSkeleton, pose_skeleton
from pop_core.body.model import BodyModel, BodyParameters


class SkinningSubset:
    """The skinning arrays of some vertices of a model, contiguous for the kernels."""

    def __init__(self, model: BodyModel, vertices: Int[np.ndarray, 'n'] | None = None) -> None:
        """Take `vertices` (indices) of a model, all of them when None."""
        ids = np.arange(len(model.v_template)) if vertices is None else vertices
        self.model = model
        self.v_template = np.ascontiguousarray(model.v_template[ids], dtype=np.float64)
        self.shapedirs = np.ascontiguousarray(model.shapedirs[ids], dtype=np.float64)
        self.posedirs = None if model.posedirs is None else model.posedirs[ids]
        self.bone_ids = np.ascontiguousarray(model.bone_ids[ids])
        self.bone_weights = np.ascontiguousarray(model.bone_weights[ids])

    def shaped(
        self, parameters: BodyParameters, skeleton: PosedSkeleton
    ) -> Float[np.ndarray, 'n 3']:
        """Return T-pose vertices [m] with shape and pose blend offsets added."""
        # One product of a flat matrix: a stack of small ones is ten times slower.
        offsets = self.shapedirs.reshape(-1, len(parameters.betas)) @ parameters.betas
        rest = self.v_template + offsets.reshape(self.v_template.shape)
        if self.posedirs is not None:
            feature = (skeleton.R_local[1:] - np.eye(3)).reshape(-1)
            rest = rest + self.posedirs @ feature
        return rest

    def vertices(
        self, parameters: BodyParameters, skeleton: PosedSkeleton
    ) -> Float[np.ndarray, 'n 3']:
        """Return posed vertices [m] in the parameters' outer frame."""
        return self.posed(self.shaped(parameters, skeleton), parameters, skeleton)

    def posed(
        self, rest: Float[np.ndarray, 'n 3'], parameters: BodyParameters, skeleton: PosedSkeleton
    ) -> Float[np.ndarray, 'n 3']:
        """Return vertices [m] in the parameters' outer frame; `rest` is what `shaped` gives."""
        return np.asarray(kernels.skin(
            rest, self.bone_ids, self.bone_weights, skeleton.G, skeleton.p, skeleton.rest_joints,
            parameters.scale, parameters.transl))

    def directional_jacobian(
        self,
        rest: Float[np.ndarray, 'v 3'],
        parameters: BodyParameters,
        skeleton: PosedSkeleton,
        vertex: Int[np.ndarray, 'n'],
        direction: Float[np.ndarray, 'n 3'],
    ) -> Float[np.ndarray, 'n x']:
        """Return `direction . d(vertex)/d(transl, rotation increments, betas, log scale)`.

        Pose blend offsets count as constant: they move a vertex by millimetres, and the next
        linearisation sees them.

        Args:
            rest: T-pose vertices that `shaped` gives [m].
            parameters: Where to linearise.
            skeleton: The posed tree of `parameters`.
            vertex: Index into this subset, one per row.
            direction: Unit vector per row, outer frame.
        """
        model = self.model
        _, e = kernels.joint_shape_derivatives(skeleton.G, model.joint_shapedirs, model.parents)
        out = np.empty((len(vertex), 3 + 72 + model.n_betas + 1))
        kernels.directional_jacobian(
            vertex, direction, rest, self.shapedirs, self.bone_ids, self.bone_weights, skeleton.G,
            skeleton.p, e, skeleton.rest_joints, model.parents, parameters.scale, out)
        return out


def vertices(
    model: BodyModel, parameters: BodyParameters, subset: Int[np.ndarray, 'n'] | None = None
) -> Float[np.ndarray, 'n 3']:
    """Return posed vertices [m] in the parameters' outer frame, all or a subset."""
    return SkinningSubset(model, subset).vertices(parameters, pose_skeleton(model, parameters))


def tpose_vertices(model: BodyModel, parameters: BodyParameters) -> Float[np.ndarray, 'v 3']:
    """Return the person's own T-pose [m], body frame, with shape and scale."""
    return parameters.scale * (model.v_template + model.shapedirs @ parameters.betas)
