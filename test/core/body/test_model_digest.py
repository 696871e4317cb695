"""Digests tell models apart exactly where their meshes differ."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pop_core.body.default_body import DEFAULT_BODY_FILE, default_body
from pop_core.body.model import BodyModel
from pop_core.body.model_digest import model_digest
from pop_core.body.model_file import ModelNotes, load_body_model, save_body_model


def changed(model: BodyModel, name: str) -> BodyModel:
    array = getattr(model, name).copy()
    array.flat[array.size // 2] += 1 if np.issubdtype(array.dtype, np.integer) else 1e-3
    return replace(model, **{name: array})


def test_a_file_read_twice_has_one_digest() -> None:
    assert model_digest(load_body_model(DEFAULT_BODY_FILE)) == model_digest(default_body())


def test_a_file_written_again_has_the_same_digest(tmp_path: Path) -> None:
    save_body_model(tmp_path / 'again.npz', default_body(), ModelNotes('', ''))
    assert model_digest(load_body_model(tmp_path / 'again.npz')) == model_digest(default_body())


@pytest.mark.parametrize(
    'name', ['v_template', 'shapedirs', 'J_regressor', 'weights', 'f'])
def test_every_array_that_moves_vertices_counts(name: str) -> None:
    assert model_digest(changed(default_body(), name)) != model_digest(default_body())


def test_pose_blend_shapes_count_and_the_name_does_not() -> None:
    model = default_body()
    posed = replace(model, posedirs=np.zeros((len(model.v_template), 3, 207)))
    assert model_digest(posed) != model_digest(model)
    assert model_digest(replace(model, name='another')) == model_digest(model)
