"""`pop replay --body --library --set`: what is asked for is fitted, here and in a node."""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from support.node import ROOT
from support.recording import record
from support.smpl_body import SPLIT, imported_body
from typer.testing import CliRunner

from pop_core.body.default_body import default_body
from pop_core.errors import PopError
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.library_file import save_library
from pop_ros.bag_reader import BagReader
from pop_ros.cli import build_app
from pop_ros.recorded_bodies import MESH
from pop_ros.ros1_conversion import read_marker

FEW_POSES = 20_000
LIFETIME_S = 7


@dataclass(frozen=True)
class Asked:
    """A recording of one frame, its keypoints, and files to fit it with."""

    bag: Path
    keypoints: Path
    body: Path
    library: Path

    def replay(self, out: Path, *more: object) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
            [str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])])}
        command: Sequence[object] = (
            sys.executable, '-m', 'pop_ros.cli', 'replay', self.bag, '--out', out, '--keypoints',
            'json', '--keypoints-dir', self.keypoints, *more)
        # Relative names of files are those from here.
        return subprocess.run(
            [str(word) for word in command], env=environment, cwd=self.body.parent,
            capture_output=True, text=True, timeout=240, check=False)


@pytest.fixture(scope='module')
def asked(tmp_path_factory: pytest.TempPathFactory) -> Asked:
    folder = tmp_path_factory.mktemp('asked')
    (folder / 'keypoints').mkdir()
    recording = record(folder / 'keypoints', n_frames=1, rate_hz=1.0)
    bag = recording.write(folder / 'in.mcap', '16UC1')
    library = folder / 'few.poplib'
    save_library(default_library().subset(np.arange(FEW_POSES)), library)
    return Asked(bag, recording.keypoints, imported_body(folder), library)


@pytest.mark.parametrize('how', [['--every-frame', '--pictures', 'look'], []])
def test_the_mesh_is_that_of_the_body_and_settings_have_effect(
    asked: Asked, tmp_path: Path, how: list[str]
) -> None:
    done = asked.replay(
        tmp_path / 'out', *how, '--body', asked.body.name, '--library', asked.library.name,
        '--set', f'mesh.lifetime_s={LIFETIME_S}', '--set', 'tf.frames=off', '--set',
        'retrieval.candidates=4')
    assert done.returncode == 0, done.stdout + done.stderr
    assert '1 frames fitted of 1 pairs' in done.stdout
    with BagReader(tmp_path / 'out') as bag:
        (marker, corners), = (read_marker(m.data) for m in bag.messages([MESH]))
    assert len(corners) == 3 * (len(default_body().f) + 2 * SPLIT)
    assert marker.lifetime.sec == LIFETIME_S
    assert not how or (asked.body.parent / 'look' / 'report.html').is_file()


def test_a_setting_of_the_pipeline_leaves_out_whom_it_should(
    asked: Asked, tmp_path: Path
) -> None:
    done = asked.replay(tmp_path / 'out', '--every-frame', '--set', 'max_range_m=1')
    assert '1 frames fitted of 1 pairs (3 messages), 0 people' in done.stdout


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--body', '/none.npz'], '/none.npz: expected a body model file'),
    (['--every-frame', '--body', __file__], 'expected an npz archive'),
    (['--library', __file__], 'expected a pose library'),
    (['--every-frame', '--set', 'trackin.enabled=false'], 'tracking.enabled'),
    (['--node-running', '--body', '/none.npz'], 'give them to the one that runs'),
    (['--node-running', '--set', 'max_people=1'], 'give them to the one that runs'),
    (['--node-running', '--keypoints', 'json'], 'give them to the one that runs'),
    (['--pictures', 'look', '--set', 'mesh.detail=reduced'], 'draw the full mesh of every'),
    (['--pictures', 'look', '--set', 'mesh.max_rate_hz=5'], 'draw the full mesh of every'),
])
def test_what_makes_no_sense_is_refused_before_a_node_starts(
    asked: Asked, tmp_path: Path, arguments: list[str], told: str
) -> None:
    done = CliRunner().invoke(build_app('replay'), [
        'replay', str(asked.bag), '--out', str(tmp_path / 'out'), *arguments])
    # Errors of the package become a line and this code in main.
    assert done.exit_code == 2 or isinstance(done.exception, PopError)
    said = ' '.join(f'{done.output} {done.exception}'.replace('│', ' ').split())
    assert told in said
    assert not (tmp_path / 'out').exists()
