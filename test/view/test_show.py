"""`pop show`: bodies of a bag over the recording they were found in."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from support.node import ROOT
from support.recording import Recording, record, write_frames

from pop_core.body.default_body import default_body
from pop_ros.evenly import Evenly
from pop_ros.recorded_bodies import read_bodies
from pop_ros.show_recording import ShowError, ShowRequest, show_recording


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=3, rate_hz=4.0)


@pytest.fixture(scope='module')
def drawn(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording, its bodies, and what `pop replay --pictures` drew."""
    folder = tmp_path_factory.mktemp('show')
    # Nobody says anything of the middle frame: whoever is found there was followed.
    keypoints = folder / 'keypoints'
    keypoints.mkdir()
    for stamp in recording.stamps[::2]:
        source = recording.keypoints / f'{stamp}.json'
        (keypoints / source.name).write_bytes(source.read_bytes())
    bag = recording.write(folder / 'camera.mcap', '16UC1')
    done = subprocess.run(
        [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--every-frame', '--keypoints',
         'json', '--keypoints-dir', str(keypoints), '--out', str(folder / 'bodies'),
         '--pictures', str(folder / 'pictures'), '--overlays'],
        env={**os.environ, 'PYTHONPATH': str(ROOT)}, capture_output=True, text=True, timeout=240,
        check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_a_replay_with_pictures_writes_a_film_of_every_frame(drawn: Path) -> None:
    video = cv2.VideoCapture(str(drawn / 'pictures' / 'film.mp4'))
    frames = []
    while (read := video.read())[0]:
        frames.append(read[1].astype(int))
    assert len(frames) == 3
    assert all(np.abs(a - b).mean() > 0.5 for a, b in pairwise(frames))


def test_the_page_holds_a_3d_view_a_strip_and_what_the_replay_said(
    drawn: Path, recording: Recording
) -> None:
    text = (drawn / 'pictures' / 'report.html').read_text()
    scenes, strip = (json.loads(data) for data in re.findall(
        r'<script type="application/json">(.*?)</script>', text, re.DOTALL))
    recorded = read_bodies(drawn / 'bodies')
    people = [len(recorded[stamp].ids) if stamp in recorded else 0 for stamp in recording.stamps]
    words = {0: 'nobody', 1: '1 person'}
    captions = [f'{0.25 * k:.2f} s: {words[count]}' for k, count in enumerate(people)]
    assert [frame['caption'] for frame in strip] == captions
    assert [frame['caption'] for frame in scenes['frames']] == captions
    assert [len(frame['bodies']) for frame in scenes['frames']] == people
    assert f'Frames: 3. Bodies: {sum(people)}.' in text
    assert 'frames fitted of 3 pairs' in text


def test_a_picture_of_every_frame_is_named_by_its_stamp(
    drawn: Path, recording: Recording
) -> None:
    pictures = sorted((drawn / 'pictures' / 'overlays').iterdir())
    assert [path.name for path in pictures] == [f'{stamp}.png' for stamp in recording.stamps]
    height = recording.scenes[0].frame.camera.height
    assert all(cv2.imread(str(path)).shape[0] > 2 * height for path in pictures)


@pytest.mark.parametrize('total', [1, 2, 5, 6, 12, 13, 14, 100, 1000, 1023])
def test_of_many_items_a_few_are_kept_evenly_with_the_first_and_the_last(total: int) -> None:
    spread = Evenly[int](6)
    for number in range(total):
        spread.add(number)
    chosen = spread.chosen()
    assert (chosen[0], chosen[-1], len(chosen)) == (0, total - 1, min(6, total))
    gaps = np.diff(chosen)
    assert not len(gaps) or gaps.min() > 0
    assert not len(gaps) or gaps.max() <= max(2, 0.4 * total)


def test_bodies_of_another_body_model_are_refused(drawn: Path) -> None:
    model = default_body()
    other = replace(model, f=model.f[:-10])
    with pytest.raises(ShowError, match=r'expected meshes of \d+ triangles'):
        show_recording(ShowRequest((drawn / 'camera',), drawn / 'bodies', drawn / 'no'), other)


def test_bodies_of_another_recording_are_refused(
    drawn: Path, recording: Recording, tmp_path: Path
) -> None:
    later = [replace(s.frame, stamp_ns=s.frame.stamp_ns + 10**12) for s in recording.scenes[:1]]
    other = write_frames(tmp_path / 'other.db3', later, '16UC1')
    with pytest.raises(ShowError, match='found no frame with these stamps'):
        show_recording(ShowRequest((other,), drawn / 'bodies', tmp_path / 'out'), default_body())
