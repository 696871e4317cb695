"""Meshes from what ~/bodies carries: a receiver needs the model and 340 bytes per person."""

from __future__ import annotations

from typing import Any

import numpy as np
from jaxtyping import Float

from pop_core.body.kinematics import pose_skeleton
from pop_core.body.model import BodyModel
from pop_core.body.model_digest import model_digest
from pop_core.body.skinning import SkinningSubset
from pop_ros.message_error import BadMessageError
from pop_ros.pop_messages import parameters_of


class BodyRebuilder:
    """Skins one body model with parameters as they arrive."""

    def __init__(self, model: BodyModel) -> None:
        """Prepare a model; kernels are compiled when first used."""
        self.model = model
        self.digest = model_digest(model)
        self._skin = SkinningSubset(model)

    def mismatch(self, message: Any) -> str:
        """Return why a pop_msgs/BodyModel is not the model here, or '' if it is."""
        if message.digest == self.digest:
            return ''
        return (
            f'body_model: expected {self.model.name!r} of digest {self.digest}, which stands '
            f'here, found {message.name!r} of digest {message.digest or "unknown"} with '
            f'{message.vertex_count} vertices: no mesh is shown rather than a wrong one; start '
            'the viewer with the file of the node\'s model (--body FILE)')

    def vertices(self, message: Any) -> Float[np.ndarray, 'v 3']:
        """Return the mesh [m] of a pop_msgs/Body in the frame of its message.

        Raises:
            BadMessageError: If its parameters do not pose this model.
        """
        parameters = parameters_of(message.parameters)
        if len(parameters.betas) != self.model.n_betas:
            raise BadMessageError(
                f'body {message.id}: expected {self.model.n_betas} betas, found '
                f'{len(parameters.betas)}')
        numbers = np.concatenate([
            parameters.transl, parameters.global_orient, parameters.body_pose.ravel(),
            parameters.betas, [parameters.scale]])
        if not np.isfinite(numbers).all():
            raise BadMessageError(f'body {message.id}: expected finite parameters, found others')
        return self._skin.vertices(parameters, pose_skeleton(self.model, parameters))
