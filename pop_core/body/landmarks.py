"""Points on the skin that other systems' skeletons have and SMPL's tree has not: face and feet.

They are vertices, found on the T-pose of any model with SMPL's joints, so that they move with
shape and pose. Eyes follow from the nose by the proportions of a head: about 60 mm apart and
28 mm above its tip where the head is 0.23 m high; good to a centimetre.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float, Int

from pop_core.body.joints import JOINT_INDEX
from pop_core.body.model import BodyModel

LANDMARK_NAMES = (
    'nose', 'left_eye', 'right_eye', 'left_ear', 'right_ear', 'left_big_toe', 'right_big_toe',
    'left_heel', 'right_heel',
)
# The joint whose uncertainty and visibility is that of the landmark.
LANDMARK_JOINTS = np.array([JOINT_INDEX[name] for name in (
    'head', 'head', 'head', 'head', 'head', 'left_foot', 'right_foot', 'left_ankle',
    'right_ankle')])
EYE_ASIDE, EYE_ABOVE = 0.13, 0.12  # of the head's height, from the tip of the nose
EAR_BAND = (-0.1, 0.25)  # ears lie between these heights above the nose, in head heights


def landmark_vertices(model: BodyModel) -> Int[np.ndarray, 'l']:
    """Return the vertex of each of LANDMARK_NAMES."""
    return np.array([
        model.nose_vertex, _eye(model, 1), _eye(model, -1), _ear(model, 1), _ear(model, -1),
        _foot_end(model, 'left', 1), _foot_end(model, 'right', 1),
        _foot_end(model, 'left', -1), _foot_end(model, 'right', -1)])


def _eye(model: BodyModel, side: int) -> int:
    """Return the vertex of the face nearest to where an eye is; side 1 is the person's left."""
    v, height_m = model.v_template, _head_height_m(model)
    nose = v[model.nose_vertex]
    target = nose[:2] + np.array([side * EYE_ASIDE, EYE_ABOVE]) * height_m
    in_front = v[:, 2] > nose[2] - 0.25 * height_m
    distance_m = np.linalg.norm(v[:, :2] - target, axis=1)
    return _least(distance_m, _on(model, 'head') & in_front)


def _ear(model: BodyModel, side: int) -> int:
    """Return the outermost vertex of the head at the height of the ears."""
    above = (model.v_template[:, 1] - model.v_template[model.nose_vertex, 1])
    low, high = np.array(EAR_BAND) * _head_height_m(model)
    return _least(-side * model.v_template[:, 0], _on(model, 'head') & (low < above)
                  & (above < high))


def _foot_end(model: BodyModel, side: str, forward: int) -> int:
    """Return the foremost (1) or rearmost (-1) vertex of a foot."""
    lowest_m = model.v_template[:, 1].min()
    ankle_m = model.joint_template[JOINT_INDEX[f'{side}_ankle'], 1]
    low = model.v_template[:, 1] < 0.5 * (lowest_m + ankle_m)
    on_foot = _on(model, f'{side}_foot', f'{side}_ankle')
    return _least(-forward * model.v_template[:, 2], on_foot & low)


def _on(model: BodyModel, *joints: str) -> Bool[np.ndarray, 'v']:
    """Return which vertices these joints move most; all if there is none, as of no human body."""
    weight = sum(model.weights[:, JOINT_INDEX[name]] for name in joints)
    found = np.asarray(weight > 0.5)
    return found if found.any() else np.ones_like(found)


def _head_height_m(model: BodyModel) -> float:
    return float(np.ptp(model.v_template[_on(model, 'head'), 1]))


def _least(value: Float[np.ndarray, 'v'], allowed: Bool[np.ndarray, 'v']) -> int:
    return int(np.argmin(np.where(allowed, value, np.inf)))
