import os
import pickle
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.smpl_files import N_VERTICES, family_arrays, write_smpl_pickle
from typer.testing import CliRunner

from pop_core.body.model_file import load_body_model
from pop_core.rendering.palette import PAPER
from pop_ros.body_commands import app


def _run(*arguments: object) -> str:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert result.exit_code == 0, result.output
    return result.output


@pytest.fixture
def smpl_file(tmp_path: Path) -> Path:
    return write_smpl_pickle(tmp_path / 'basicmodel_f.pkl', family_arrays(24, 10, 207))


def test_info_of_the_default_body_names_size_stature_checks_and_licence() -> None:
    text = _run('info')
    for fact in ('6678 vertices', '1200 vertices', '1.69', 'closed', 'outward', 'Apache-2.0'):
        assert fact in text


def test_import_writes_a_body_that_info_and_the_loader_read(
    tmp_path: Path, smpl_file: Path
) -> None:
    out = tmp_path / 'new' / 'body.npz'
    assert 'basicmodel_f' in _run('import', smpl_file, '--out', out, '--betas', 4)
    assert load_body_model(out).n_betas == 4
    text = _run('info', out)
    assert f'{N_VERTICES} vertices' in text
    assert '207' in text


def test_show_draws_every_beta_pair_and_pose(tmp_path: Path) -> None:
    out = tmp_path / 'body.png'
    assert 'body.png' in _run('show', '--out', out)
    picture = cv2.imread(str(out))
    assert picture.shape[0] > 1000
    assert picture.shape[1] > 1000
    drawn = (picture != np.array(PAPER[::-1])).any(axis=2)
    # Four rows of bodies, none of them empty, none of them a filled block.
    for row in np.array_split(drawn, 4):
        assert 0.05 < row.mean() < 0.6


def test_a_hostile_file_ends_in_one_line_and_exit_code_2(tmp_path: Path) -> None:
    class Evil:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.system, ('echo ran',)

    path = tmp_path / 'evil.pkl'
    path.write_bytes(pickle.dumps({'v_template': Evil()}))
    command = [sys.executable, '-m', 'pop_ros.cli', 'body', 'import', path, '--out', 'x.npz']
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count('\n') == 1
    assert 'system' in done.stderr
    assert 'ran\n' not in done.stdout
