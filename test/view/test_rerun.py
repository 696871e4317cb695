"""A recording for the rerun viewer, read back by rerun itself."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.rendering.shown_body import ShownBody
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.report3d import SceneFrame
from pop_ros.rerun_export import RerunError, write_rerun


@pytest.fixture(scope='module')
def scenes() -> list[SceneFrame]:
    """A person in the first and the last frame, nobody between."""
    found = []
    for number, truth in enumerate(synthesise_sequence(default_body(), 4, 3, rate_hz=4.0)):
        person = truth.people[0]
        body = ShownBody(
            person.vertices.astype(np.float64), person.joints, person.joint_state, person.mask)
        found.append(SceneFrame(truth.frame, [] if number == 1 else [body], ''))
    return found


def rerun(*arguments: object) -> str:
    done = subprocess.run(
        [sys.executable, '-m', 'rerun', *map(str, arguments)], capture_output=True, text=True,
        timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_rerun_finds_camera_and_bodies_in_every_frame(
    scenes: list[SceneFrame], tmp_path: Path
) -> None:
    pytest.importorskip('rerun', reason='rerun SDK not installed (pip install rerun-sdk)')
    path = tmp_path / 'bodies.rrd'
    assert write_rerun(scenes, default_body().f, path) == 3
    rerun('rrd', 'verify', path)
    told = rerun('rrd', 'print', path)
    rows = {}
    for count, entity in re.findall(r'with (\d+) rows \([^)]*\) - (\S+) - ', told):
        rows[entity] = rows.get(entity, 0) + int(count)
    assert {name: rows[f'/camera/{name}'] for name in ('color', 'depth')} == {
        'color': 3, 'depth': 3}
    parts = ('mesh', 'joints', 'bones', 'points')
    assert [rows[f'/people/0/{part}'] for part in parts] == [2] * 4
    # Before each frame all people are taken away: the second frame shows nobody.
    assert rows['/people'] == 3


def test_a_missing_sdk_is_one_sentence(
    scenes: list[SceneFrame], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class NoRerun:
        """Finds that rerun is not there, as an import without it does."""

        def find_spec(self, name: str, *_others: object) -> None:
            if name == 'rerun':
                raise ModuleNotFoundError("No module named 'rerun'", name='rerun')

    monkeypatch.delitem(sys.modules, 'rerun', raising=False)
    monkeypatch.setattr(sys, 'meta_path', [NoRerun(), *sys.meta_path])
    with pytest.raises(RerunError, match='pip install rerun-sdk'):
        write_rerun([replace(scenes[0], bodies=[])], default_body().f, tmp_path / 'a.rrd')
    assert not (tmp_path / 'a.rrd').exists()
