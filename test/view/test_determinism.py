"""`pop replay --every-frame` gives the same bytes twice."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.node import ROOT
from support.recording import Recording, record


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=3, rate_hz=4.0)


def replay(bag: Path, keypoints: Path, out: Path) -> dict[str, bytes]:
    """Return the bytes of all bags that a replay in a process of its own writes."""
    # Hashes of strings differ from process to process: no order may depend on them.
    seed = {'PYTHONHASHSEED': str(len(str(out)))}
    environment = {**os.environ, 'PYTHONPATH': str(ROOT), **seed}
    out.parent.mkdir()
    done = subprocess.run(
        [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--every-frame', '--keypoints',
         'json', '--keypoints-dir', str(keypoints), '--out', str(out), '--ros1', f'{out}.bag'],
        env=environment, capture_output=True, text=True, timeout=240, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    mcap, = out.glob('*.mcap')
    return {'mcap': mcap.read_bytes(), 'bag': Path(f'{out}.bag').read_bytes()}


def test_two_replays_in_two_processes_write_the_same_bytes(
    recording: Recording, tmp_path: Path
) -> None:
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    # A rosbag2 contains its own name.
    first = replay(bag, recording.keypoints, tmp_path / 'one' / 'out')
    second = replay(bag, recording.keypoints, tmp_path / 'the_other' / 'out')
    for kind, content in first.items():
        assert len(content) > 1_000_000
        assert content == second[kind], f'the {kind} differs'
