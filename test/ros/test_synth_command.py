import numpy as np
import typer
from typer.testing import CliRunner

from pop_ros.synth_command import synth


def invoke(*arguments):
    app = typer.Typer()
    app.command()(synth)
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_scenes_are_written_one_folder_each(tmp_path):
    result = invoke('--count', 2, '--seed', 30, '--out', tmp_path)
    assert result.exit_code == 0, result.output
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {'scene_000030', 'scene_000031', 'contact_sheet.png'}
    files = {path.name for path in (tmp_path / 'scene_000030').iterdir()}
    assert files == {'color.png', 'depth.png', 'camera.json', 'keypoints.json', 'truth.npz'}


def test_a_sequence_shows_one_person_moving(tmp_path):
    result = invoke('--count', 3, '--sequence', '--out', tmp_path)
    assert result.exit_code == 0, result.output
    pelvis = [np.load(tmp_path / f'frame_{k:04d}' / 'truth.npz')['joints'][0, 0] for k in range(3)]
    assert np.linalg.norm(pelvis[2] - pelvis[0]) > 0.1
