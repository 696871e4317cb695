"""The same body on few vertices: same joints, same shapes, a fifth of the triangles."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from pop_core.body.model import BodyModel


def coarse_body(model: BodyModel) -> BodyModel:
    """Return the model on its coarse mesh, with joints exactly where the fine one has them.

    Joints are affine in the shape, so that a regressor from any vertices that span template and
    shape directions gives the fine model's joints without error; the one of least norm is taken.

    Args:
        model: Body with a coarse mesh (`fit_vertices`, `fit_faces`).
    """
    ids = model.fit_vertices
    regressor = np.linalg.lstsq(
        _affine(model.v_template[ids], model.shapedirs[ids]),
        _affine(model.joint_template, model.joint_shapedirs), rcond=None)[0].T
    return BodyModel(
        name=f'{model.name} coarse', v_template=model.v_template[ids],
        shapedirs=model.shapedirs[ids],
        posedirs=None if model.posedirs is None else model.posedirs[ids],
        J_regressor=regressor, weights=model.weights[ids], parents=model.parents,
        f=model.fit_faces, fit_vertices=np.arange(len(ids)), fit_faces=model.fit_faces,
    )


def _affine(
    template: Float[np.ndarray, 'n 3'], shapedirs: Float[np.ndarray, 'n 3 b']
) -> Float[np.ndarray, 'k n']:
    """Return what a weighted sum of points must keep: the sum of weights, template and shapes."""
    coordinates = np.concatenate([template[:, :, None], shapedirs], axis=2).reshape(
        len(template), -1)
    return np.vstack([np.ones(len(template)), coordinates.T])
