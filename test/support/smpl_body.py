"""A file of the SMPL family of a person who can be fitted, and the body model it becomes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from support.smpl_files import write_smpl_pickle

from pop_core.body.default_body import default_body
from pop_core.body.joints import N_JOINTS
from pop_core.body.model_file import ModelNotes, save_body_model
from pop_core.body.smpl_import import import_body_model

SPLIT = 50  # triangles of the default body that get a vertex in their middle: another topology
POSE_FEATURES = 9 * (N_JOINTS - 1)
PULL_M = 0.001


def person_arrays() -> dict[str, np.ndarray]:
    """Return the default body under SMPL's published names, its mesh a little finer."""
    body = default_body()
    corners, n = body.f[:SPLIT], len(body.v_template)
    middle = n + np.arange(SPLIT)
    finer = [np.column_stack([corners[:, a], corners[:, b], middle])
             for a, b in ((0, 1), (1, 2), (2, 0))]

    def with_middles(array: np.ndarray) -> np.ndarray:
        return np.concatenate([array, array[corners].mean(axis=1)])

    posedirs = np.zeros((n + SPLIT, 3, POSE_FEATURES))
    posedirs[:, :, 0] = PULL_M
    return {
        'v_template': with_middles(body.v_template),
        'shapedirs': with_middles(body.shapedirs),
        'posedirs': posedirs,
        'weights': with_middles(body.weights),
        'J_regressor': np.pad(body.J_regressor, ((0, 0), (0, SPLIT))),
        'kintree_table': np.stack([body.parents, np.arange(N_JOINTS)]).astype(np.uint32),
        'f': np.concatenate([*finer, body.f[SPLIT:]]).astype(np.uint32),
    }


def imported_body(folder: Path) -> Path:
    """Return a body file that `pop body import` has made of a person's SMPL file."""
    model = import_body_model(write_smpl_pickle(folder / 'person.pkl', person_arrays()))
    path = folder / 'person.npz'
    save_body_model(path, model, ModelNotes('', ''))
    return path
