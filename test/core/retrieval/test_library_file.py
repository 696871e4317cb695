from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.errors import LibraryFileError
from pop_core.retrieval.library_file import (
    ARRAYS,
    load_library,
    new_library_file,
    read_header,
    save_library,
)
from pop_core.retrieval.library_merge import merge_libraries
from pop_core.retrieval.pose_library import (
    PoseLibrary,
    build_library,
    on_body,
    pose_columns,
)


def small_library(n: int = 37, seed: int = 0) -> PoseLibrary:
    rng = np.random.default_rng(seed)
    return build_library(rng.normal(size=(n, 23, 3)) * 0.4, default_body())


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    path = tmp_path / 'poses.poplib'
    save_library(small_library(), path, {'origin': 'test'})
    return path


def test_a_library_returns_from_its_file(saved):
    before, after = small_library(), load_library(saved, verify=True)
    for name in ARRAYS:
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    assert read_header(saved).notes == {'origin': 'test'}


def test_arrays_stay_in_the_file(saved):
    library = load_library(saved)
    assert isinstance(library.body_pose, np.memmap)
    assert not library.body_pose.flags.writeable


def test_joints_are_those_of_the_poses(saved):
    library = load_library(saved)
    columns = pose_columns(
        library.body_pose.astype(float), library.tilt.astype(float), default_body())
    assert np.allclose(library.columns, columns, atol=1e-6)


def test_another_body_has_joints_of_its_own(saved):
    library, model = load_library(saved), default_body()
    assert np.allclose(on_body(library, model).columns, library.columns, atol=1e-6)
    child = replace(model, v_template=0.6 * model.v_template, shapedirs=0.6 * model.shapedirs)
    assert np.allclose(on_body(library, child).columns, 0.6 * library.columns, atol=1e-5)


@pytest.mark.parametrize('kept', [3, 16, 500, 5000])
def test_a_cut_file_is_refused(saved, kept):
    saved.write_bytes(saved.read_bytes()[:kept])
    with pytest.raises(LibraryFileError, match='expected'):
        load_library(saved)


def test_a_changed_byte_is_found_by_the_checksum(saved):
    data = bytearray(saved.read_bytes())
    data[6000] ^= 1
    saved.write_bytes(bytes(data))
    load_library(saved)
    with pytest.raises(LibraryFileError, match='checksum'):
        load_library(saved, verify=True)


def test_another_version_is_refused(saved):
    data = bytearray(saved.read_bytes())
    data[:8] = b'POPLIB99'
    saved.write_bytes(bytes(data))
    with pytest.raises(LibraryFileError, match='POPLIB01'):
        load_library(saved)


def test_something_else_is_refused(tmp_path):
    path = tmp_path / 'notes.txt'
    path.write_text('no poses here, just words that go on for a while')
    with pytest.raises(LibraryFileError, match='expected a pose library'):
        load_library(path)
    with pytest.raises(LibraryFileError, match='expected a pose library'):
        load_library(tmp_path / 'absent')


def test_a_failed_write_leaves_nothing_behind(tmp_path):
    path = tmp_path / 'poses.poplib'
    with pytest.raises(ZeroDivisionError), new_library_file(path, 3, {}) as arrays:
        arrays['masks'][0] = 1 // 0
    assert list(tmp_path.iterdir()) == []


def test_merged_libraries_hold_both(tmp_path):
    first, second = tmp_path / 'a.poplib', tmp_path / 'b.poplib'
    save_library(small_library(20, 1), first)
    save_library(small_library(30, 2), second)
    out = tmp_path / 'both.poplib'
    assert merge_libraries(out, [first, second]) == 50
    both = load_library(out, verify=True)
    assert np.array_equal(both.body_pose[:20], load_library(first).body_pose)
    assert np.array_equal(both.columns[:, :, 20:], load_library(second).columns)


def test_merging_a_library_with_itself_adds_nothing(tmp_path):
    path = tmp_path / 'a.poplib'
    save_library(small_library(40, 3), path)
    assert merge_libraries(tmp_path / 'twice.poplib', [path, path], spacing_m=0.001) == 40


def test_a_file_may_be_named_by_text(tmp_path):
    save_library(small_library(), str(tmp_path / 'poses.poplib'))
    assert len(load_library(str(tmp_path / 'poses.poplib'), verify=True)) == len(small_library())
