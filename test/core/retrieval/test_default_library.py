import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.body.joint_limits import LOWER, UPPER, pose_coordinates
from pop_core.retrieval.default_library import (
    default_library,
    default_library_path,
    generate_library,
)
from pop_core.retrieval.pruning import nearest_distances

SIZE = 1500


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv('XDG_CACHE_HOME', str(tmp_path))
    return tmp_path


def test_poses_are_diverse_and_within_limits():
    library = generate_library(default_body(), SIZE, seed=2)
    assert len(library) == SIZE
    c = pose_coordinates(library.body_pose.astype(float))
    assert (c > LOWER - 1e-5).all()
    assert (c < UPPER + 1e-5).all()
    joints = np.ascontiguousarray(library.joints)
    for row in (0, 700, SIZE - 1):
        others = np.delete(joints, row, axis=0)
        assert nearest_distances(joints[row: row + 1], others)[0] > 0.035


def test_one_seed_gives_one_library():
    first, second, other = (
        generate_library(default_body(), 300, seed=seed).body_pose for seed in (5, 5, 6))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, other)


def test_first_use_generates_and_second_use_reads(cache):
    calls: list[tuple[int, int]] = []
    first = default_library(lambda done, total: calls.append((done, total)), SIZE)
    assert calls[-1] == (SIZE, SIZE)
    calls.clear()
    second = default_library(lambda done, total: calls.append((done, total)), SIZE)
    assert calls == []
    assert np.array_equal(first.body_pose, second.body_pose)
    assert default_library_path(SIZE).is_relative_to(cache)


def test_a_cache_that_cannot_be_written_costs_only_the_next_start(cache, monkeypatch):
    blocked = cache / 'file'
    blocked.write_text('in the way')
    monkeypatch.setenv('XDG_CACHE_HOME', str(blocked))
    assert len(default_library(size=SIZE)) == SIZE


def test_a_damaged_cache_is_generated_again(cache):
    default_library(size=SIZE)
    path = default_library_path(SIZE)
    data = bytearray(path.read_bytes())
    data[9000] ^= 1
    path.write_bytes(bytes(data))
    calls: list[int] = []
    default_library(lambda done, _: calls.append(done), SIZE)
    assert calls
