"""`pop library` from the command line, on small libraries."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from benchmarks.pose_files import write_amass
from pop_core.body.default_body import default_body
from pop_core.errors import LibraryFileError
from pop_core.geometry.rotation import from_rotvec
from pop_core.retrieval.default_library import generate_library
from pop_core.retrieval.library_file import load_library, save_library
from pop_ros.library_commands import app

SIZE = 800


@pytest.fixture(scope='module')
def library(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp('library') / 'small.poplib'
    save_library(generate_library(default_body(), SIZE, seed=4), path, {'origin': 'a test'})
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(a) for a in arguments], catch_exceptions=True)


def test_info_says_what_the_file_holds(library):
    result = run('info', library)
    assert result.exit_code == 0, result.output
    for text in ('800', 'a test', 'good', 'trunk upright'):
        assert text in result.output


def test_info_refuses_a_damaged_file(library, tmp_path):
    data = bytearray(library.read_bytes())
    data[7000] ^= 4
    broken = tmp_path / 'broken.poplib'
    broken.write_bytes(bytes(data))
    result = run('info', broken)
    assert isinstance(result.exception, LibraryFileError)
    assert 'checksum' in str(result.exception)


def test_sample_draws_the_poses_asked_for(library, tmp_path):
    out = tmp_path / 'sheet.png'
    assert run('sample', library, '--count', 12, '--out', out).exit_code == 0
    picture = cv2.imread(str(out))
    assert picture.shape == (320, 1600, 3)
    tiles = picture.reshape(2, 160, 10, 160, 3).transpose(0, 2, 1, 3, 4).reshape(20, -1)
    assert ((tiles < 200).any(axis=1)).sum() == 12


def test_query_finds_the_pose_behind_what_is_hidden(library, tmp_path):
    out = tmp_path / 'answers.png'
    result = run('query', library, '--pose', 321, '--hide', 'left_wrist,left_elbow', '--out', out)
    assert result.exit_code == 0, result.output
    assert '321' in result.output.split('belief')[1].splitlines()[2]
    assert 'searched in' in result.output
    assert cv2.imread(str(out)) is not None


def test_query_reads_joints_of_a_file(library, tmp_path):
    joints = load_library(library).joints[77] @ from_rotvec(np.array([np.pi, 0, 0])).T + [0, 0, 2]
    rows = joints.tolist()
    rows[5] = None
    path = tmp_path / 'joints.json'
    path.write_text(json.dumps(rows))
    result = run('query', library, '--joints', path, '--candidates', 1)
    assert '77' in result.output.split('belief')[1].splitlines()[2]


@pytest.mark.parametrize(('arguments', 'match'), [
    (['--hide', 'tail'], 'tail'), (['--pose', '800'], 'expected 0 to 799'),
])
def test_query_says_what_is_wrong(library, arguments, match):
    result = run('query', library, *arguments)
    assert isinstance(result.exception, LibraryFileError)
    assert match in str(result.exception)


def test_query_refuses_other_files(library, tmp_path):
    path = tmp_path / 'joints.json'
    for text in ('[[1, 2, 3]]', 'no json', '{"a": 1}'):
        path.write_text(text)
        result = run('query', library, '--joints', path)
        assert isinstance(result.exception, LibraryFileError), text


def test_build_reads_folders_and_names_what_it_left_out(tmp_path):
    rng = np.random.default_rng(0)
    for i in range(3):
        body = rng.normal(size=(20, 23, 3)) * 0.2
        write_amass(tmp_path / f'{i}_poses.npz', np.zeros((20, 3)), body)
    (tmp_path / 'broken.npz').write_bytes(b'PK nothing')
    out = tmp_path / 'mine.poplib'
    result = run('build', out, '--amass', tmp_path, '--every', 2, '--jobs', 1, '--spacing', 0)
    assert result.exit_code == 0, result.output
    flat = ' '.join(result.output.split())
    assert '60 poses kept of 60 read from 3 files; 1 left out' in flat
    assert 'broken.npz' in result.output.replace('\n', '')
    assert len(load_library(out, verify=True)) == 60


def test_build_without_a_source_is_refused(tmp_path):
    result = run('build', tmp_path / 'mine.poplib')
    assert isinstance(result.exception, LibraryFileError)
    assert '--amass' in str(result.exception)


def test_merge_joins(library, tmp_path):
    out = tmp_path / 'both.poplib'
    result = run('merge', out, library, library, '--spacing', 0.01)
    assert result.exit_code == 0, result.output
    assert len(load_library(out)) == SIZE
