import subprocess
import sys

import pytest
from typer.testing import CliRunner

from pop_ros.cli import COMMANDS, build_app


def test_help_names_every_command_and_loads_none_of_them():
    result = CliRunner().invoke(build_app(None), ['--help'])
    assert result.exit_code == 0
    assert all(command.name in result.output for command in COMMANDS)
    script = (
        'import sys; from pop_ros.cli import build_app; build_app(None); '
        'sys.exit(any(name in sys.modules for name in ("numpy", "rclpy", "numba")))')
    assert subprocess.run([sys.executable, '-c', script], check=False).returncode == 0


@pytest.mark.parametrize(
    'command', [c for c in COMMANDS if not c.passes_all], ids=lambda c: c.name)
def test_every_command_has_help_that_says_what_it_does(command):
    result = CliRunner().invoke(build_app(command.name), [command.name, '--help'])
    assert result.exit_code == 0, result.output
    assert 'Usage' in result.output


def test_the_node_parses_its_own_arguments():
    pytest.importorskip('rclpy')
    command = [sys.executable, '-m', 'pop_ros.cli', 'node', '--help']
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0
    assert '--keypoints-dir' in result.stdout


def test_an_unknown_command_is_refused():
    result = CliRunner().invoke(build_app('dance'), ['dance'])
    assert result.exit_code == 2


def test_version_prints_one_line_per_dependency():
    result = CliRunner().invoke(build_app('version'), ['version'])
    assert result.output.startswith('pop ')
    assert 'numpy' in result.output
