import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.pose_files import write_amass, write_bvh, write_surreal
from pop_core.body.default_body import default_body
from pop_core.errors import LibraryFileError
from pop_core.retrieval import library_builder
from pop_core.retrieval.build_workers import ProcessRunner, run_here
from pop_core.retrieval.library_builder import (
    BuildOptions,
    PoseSource,
    build_from_files,
    find_sources,
)
from pop_core.retrieval.library_file import load_library
from pop_core.retrieval.pruning import nearest_distances

MODEL = default_body()
ALL = BuildOptions(mirror=False, spacing_m=0.0)


def poses(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    body = rng.normal(size=(n, 23, 3)) * 0.2
    body[:, 21:] = 0  # AMASS' fingers are not read
    return rng.normal(size=(n, 3)) * 0.1, body


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / 'amass' / 'sub').mkdir(parents=True)
    for i in range(5):
        write_amass(tmp_path / 'amass' / 'sub' / f'{i}_poses.npz', *poses(30, i))
    np.savez(tmp_path / 'amass' / 'shape.npz', betas=np.zeros(16))
    return tmp_path


def build(folder: Path, options: BuildOptions = ALL, runner=run_here, kind: str = 'amass'):
    sources = find_sources(kind, folder / 'amass')
    out = folder / 'out.poplib'
    return build_from_files(out, sources, options, MODEL, runner=runner), out


def test_the_library_holds_the_poses_of_all_files_in_order(folder):
    report, out = build(folder)
    assert (report.files, report.poses_read, report.poses_kept) == (5, 150, 150)
    library = load_library(out, verify=True)
    expected = np.concatenate([poses(30, i)[1] for i in range(5)])
    assert np.allclose(library.body_pose, expected, atol=1e-6)
    assert not (folder / 'out.poplib.parts').exists()


def test_every_and_mirror_count(folder):
    report, out = build(folder, BuildOptions(every=3, mirror=True, spacing_m=0.0))
    assert report.poses_kept == 5 * 10 * 2
    library = load_library(out)
    signs = np.array([1, -1, -1])
    assert np.allclose(library.body_pose[10, 3], library.body_pose[0, 4] * signs, atol=1e-6)


def test_poses_that_are_near_are_left_out(folder):
    report, out = build(folder, BuildOptions(mirror=False, spacing_m=0.08))
    assert 10 < report.poses_kept < 150
    joints = np.ascontiguousarray(load_library(out).joints)
    assert nearest_distances(joints[1:2], np.delete(joints, 1, axis=0))[0] > 0.08


def test_bad_files_are_named_and_the_rest_goes_on(folder):
    (folder / 'amass' / 'bad.npz').write_bytes(b'not a zip')
    np.savez(folder / 'amass' / 'nan.npz', poses=np.full((3, 156), np.nan))
    report, _ = build(folder)
    assert report.poses_kept == 150
    assert len(report.failures) == 2
    assert all('\n' not in line for line in report.failures)
    assert 'bad.npz: expected an npz' in report.failures[0]
    assert 'nan.npz: frame 0' in report.failures[1]


def test_an_interrupted_build_goes_on_where_it_stopped(folder, monkeypatch):
    def stops(sources, options, model):
        for position, result in run_here(sources, options, model):
            if position == 3:
                raise KeyboardInterrupt
            yield position, result

    with pytest.raises(KeyboardInterrupt):
        build(folder, runner=stops)
    asked: list[int] = []

    def counts(sources, options, model):
        asked.append(len(sources))
        return run_here(sources, options, model)

    report, out = build(folder, runner=counts)
    assert asked == [2]
    assert report.poses_kept == 150
    whole = load_library(out).body_pose.copy()
    out.unlink()
    assert np.array_equal(load_library(build(folder)[1]).body_pose, whole)


def test_a_changed_file_is_read_again(folder):
    source = PoseSource(folder / 'amass' / 'sub' / '0_poses.npz', 'amass')
    before = library_builder.shard_name(source, ALL)
    os.utime(source.path, ns=(1, 1))
    assert library_builder.shard_name(source, ALL) != before
    assert library_builder.shard_name(source, BuildOptions(every=2)) != before


def test_processes_build_the_same_library(folder):
    _, out = build(folder)
    expected = load_library(out).body_pose.copy()
    report, out = build(folder, runner=ProcessRunner(2))
    assert report.poses_kept == 150
    assert np.array_equal(load_library(out).body_pose, expected)


def test_all_kinds_can_be_mixed(folder):
    root, body = poses(4, 9)
    body *= 0.2  # within the limits that BVH poses are brought into
    write_bvh(folder / 'a.bvh', root, body, MODEL.joint_template)
    write_surreal(folder, 'b', root, body, np.zeros((4, 24, 2)))
    sources = [
        *find_sources('bvh', folder), *find_sources('surreal', folder),
        *find_sources('npz', folder / 'amass' / 'sub' / '1_poses.npz'),
    ]
    report = build_from_files(folder / 'mixed.poplib', sources, ALL, MODEL, runner=run_here)
    assert report.poses_kept == 4 + 4 + 30
    library = load_library(folder / 'mixed.poplib')
    # The spine bends evenly after BVH, which moves shoulders by a centimetre.
    assert np.allclose(library.joints[:4], library.joints[4:8], atol=0.02)


def test_a_folder_without_files_is_refused(tmp_path):
    with pytest.raises(LibraryFileError, match=r'expected files \*\.bvh, found none'):
        find_sources('bvh', tmp_path)


def test_files_without_any_pose_are_refused(tmp_path):
    (tmp_path / 'bad.npz').write_bytes(b'')
    sources = find_sources('npz', tmp_path)
    named = r'expected poses, found none in 1 files\n.*bad.npz'
    with pytest.raises(LibraryFileError, match=named):
        build_from_files(tmp_path / 'out.poplib', sources, ALL, MODEL, runner=run_here)
    assert [path.name for path in tmp_path.iterdir()] == ['bad.npz']


def test_ray_builds_the_same_library(folder):
    pytest.importorskip('ray', reason='the optional package ray is not installed')
    from pop_core.retrieval.build_workers import RayRunner

    _, out = build(folder)
    expected = load_library(out).body_pose.copy()
    runner = RayRunner('local')
    try:
        build(folder, runner=runner)
        assert np.array_equal(load_library(out).body_pose, expected)
    finally:
        runner.ray.shutdown()
