"""Body and library that a user names: as flags, as files, and in another process."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.smpl_body import SPLIT, imported_body

from pop_core.body.default_body import default_body
from pop_core.errors import LibraryFileError, ModelFileError
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_file import save_library
from pop_ros.fitting import Fitting
from pop_ros.model_files import ModelFiles
from pop_ros.node_arguments import NodeArguments, SourceArguments, parse_arguments


def test_flags_of_a_node_s_arguments_give_these_arguments(tmp_path: Path) -> None:
    for models in (ModelFiles(), ModelFiles(body=tmp_path / 'a b.npz'),
                   ModelFiles(tmp_path / 'body.npz', tmp_path / 'my.poplib')):
        given = NodeArguments(SourceArguments('json', tmp_path), models, camera='zed')
        assert parse_arguments(given.as_flags()) == given


def test_a_path_means_the_same_in_a_process_that_works_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'elsewhere').mkdir()
    monkeypatch.chdir(tmp_path)
    sent = pickle.dumps(Fitting(ModelFiles(Path('body.npz'), Path('../my.poplib'))))
    assert len(sent) < 1000
    monkeypatch.chdir('elsewhere')
    models = pickle.loads(sent).models
    assert models.body == tmp_path / 'body.npz'
    assert models.library is not None
    assert models.library.resolve() == tmp_path.parent / 'my.poplib'


def test_a_named_library_has_its_joints_on_the_named_body(tmp_path: Path) -> None:
    poses = default_library().subset(np.arange(200))
    save_library(poses, tmp_path / 'few.poplib')
    models = ModelFiles(imported_body(tmp_path), tmp_path / 'few.poplib')
    models.check()
    model = models.load_body()
    assert len(model.f) == len(default_body().f) + 2 * SPLIT
    taller = replace(model, v_template=1.1 * model.v_template)
    # Joints are stored in single precision.
    np.testing.assert_allclose(
        models.load_library(taller).joints, 1.1 * poses.joints, atol=1e-5)


@pytest.mark.parametrize('content', [None, b'', b'neither body nor library'])
def test_a_file_that_is_missing_or_of_no_format_is_refused_by_its_name(
    tmp_path: Path, content: bytes | None
) -> None:
    path = tmp_path / 'file'
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ModelFileError, match=str(path)):
        ModelFiles(body=path).check()
    with pytest.raises(LibraryFileError, match=str(path)):
        ModelFiles(library=path).check()
