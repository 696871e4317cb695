"""What an installation contains, from a wheel built of the tree as it is."""

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope='module')
def wheel(tmp_path_factory):
    pytest.importorskip('setuptools', reason='building a wheel needs setuptools')
    pytest.importorskip('wheel', reason='building a wheel needs wheel')
    out = tmp_path_factory.mktemp('wheel')
    # Nothing is written into the tree itself.
    command = [
        sys.executable, 'setup.py', '-q', 'egg_info', '-e', out, 'build', '-b', out / 'build',
        'bdist_wheel', '-d', out, '-b', out / 'bdist']
    subprocess.run(list(map(str, command)), cwd=ROOT, check=True, capture_output=True)
    with zipfile.ZipFile(next(out.glob('*.whl'))) as archive:
        yield archive


def test_a_wheel_holds_every_module_and_data_file(wheel):
    files = {
        path.relative_to(ROOT).as_posix() for package in ('pop_core', 'pop_ros')
        for path in (ROOT / package).rglob('*')
        if path.is_file() and (path.suffix == '.py' or path.parent.name == 'data')}
    assert files - set(wheel.namelist()) == set()


def test_a_wheel_holds_what_ros_looks_for(wheel):
    data = {name.split('.data/data/')[1] for name in wheel.namelist() if '.data/data/' in name}
    assert 'share/ament_index/resource_index/packages/pop_ros' in data
    assert 'share/pop_ros/package.xml' in data
    for folder in ('launch', 'config', 'rviz'):
        files = {f'share/pop_ros/{folder}/{p.name}' for p in (ROOT / folder).glob('*.*')}
        assert files <= data


def test_a_wheel_leaves_tests_and_benchmarks_at_home(wheel):
    tops = {name.split('/')[0] for name in wheel.namelist()}
    assert {top for top in tops if not top.startswith('pop_ros-')} == {'pop_core', 'pop_ros'}


def test_a_wheel_installs_the_commands(wheel):
    name = next(n for n in wheel.namelist() if n.endswith('entry_points.txt'))
    text = wheel.read(name).decode()
    assert 'pop = pop_ros.__main__:main' in text
    assert 'pop_node = pop_ros.node:main' in text
