import os
import shutil

import pytest

from pop_ros import dds_profile


@pytest.fixture(autouse=True)
def unset(monkeypatch):
    monkeypatch.setenv(dds_profile.VARIABLE, 'to be restored')
    monkeypatch.delenv(dds_profile.VARIABLE)


def memory_of(monkeypatch, free):
    usage = type('Usage', (), {'free': free})
    monkeypatch.setattr(shutil, 'disk_usage', lambda _path: usage)


def chosen():
    return os.environ.get(dds_profile.VARIABLE)


def test_images_go_through_shared_memory_where_there_is_enough(monkeypatch):
    memory_of(monkeypatch, 2 * dds_profile.FREE_BYTES)
    dds_profile.use_large_shared_memory()
    assert chosen().endswith(dds_profile.NAME)


def test_a_small_shared_memory_is_left_alone(monkeypatch):
    memory_of(monkeypatch, dds_profile.FREE_BYTES // 2)
    dds_profile.use_large_shared_memory()
    assert chosen() is None


def test_a_profile_of_the_user_stays(monkeypatch):
    memory_of(monkeypatch, 2 * dds_profile.FREE_BYTES)
    monkeypatch.setenv(dds_profile.VARIABLE, 'mine.xml')
    dds_profile.use_large_shared_memory()
    assert chosen() == 'mine.xml'


def test_a_profile_of_a_colcon_workspace_comes_before_the_source_tree(monkeypatch, tmp_path):
    memory_of(monkeypatch, 2 * dds_profile.FREE_BYTES)
    file = tmp_path / 'share' / 'pop_ros' / 'config' / dds_profile.NAME
    file.parent.mkdir(parents=True)
    file.touch()
    monkeypatch.setattr('sys.prefix', str(tmp_path / 'no environment'))
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(tmp_path))
    dds_profile.use_large_shared_memory()
    assert chosen() == str(file)
