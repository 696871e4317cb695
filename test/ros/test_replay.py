"""`pop replay` as users call it, on recordings made here and on those of a real robot."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.bags import COLOR
from support.node import ROOT
from support.recording import Recording, record, write_frames

from pop_core.rgbd import RgbdFrame
from pop_ros.bag_reader import BagReader
from pop_ros.node_arguments import SourceArguments
from pop_ros.replay import ReplaySummary
from pop_ros.replay_session import ReplayRequest, run_replay

SHARED = ROOT.parent / 'shared' / 'data'
POSENET = SHARED / 'models' / 'posenet_mobilenet_v1_075_481_641_dequant.onnx'
OUTPUTS = {'/pop/mesh', '/pop/joints', '/pop/cloud'}


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=3, rate_hz=4.0)


def pop_replay(*arguments: object) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(
        [str(ROOT), *filter(None, [os.environ.get('PYTHONPATH')])])}
    return subprocess.run(
        [sys.executable, '-m', 'pop_ros.cli', 'replay', *map(str, arguments)], env=environment,
        capture_output=True, text=True, timeout=240, check=False)


def every_frame(bag: Path, out: Path, keypoints: object, slop_s: float = 0.01) -> ReplaySummary:
    sources = (SourceArguments('json', keypoints.keypoints) if isinstance(keypoints, Recording)
               else SourceArguments(str(keypoints)))
    request = ReplayRequest(
        bags=(bag,), out=out, ros1=None, sources=sources, topics=(None, None, None), slop_s=slop_s,
        every_frame=True)
    return run_replay(request, lambda _text: None)


def counts(path: Path) -> dict[str, int]:
    with BagReader(path) as bag:
        return {topic.name: topic.count for topic in bag.topics}


def test_the_command_starts_a_node_and_writes_both_kinds_of_bag(
    recording: Recording, tmp_path: Path
) -> None:
    bag = write_frames(tmp_path / 'in.bag', [recording.scenes[1].frame], '16UC1')
    out, ros1 = tmp_path / 'out', tmp_path / 'out.bag'
    done = pop_replay(bag, '--out', out, '--ros1', ros1, '--keypoints', 'json',
                      '--keypoints-dir', recording.keypoints)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f'color {COLOR}' in done.stdout
    assert '1 frames fitted of 1 pairs (3 messages), 1 people' in done.stdout
    assert 'Traceback' not in done.stderr
    for path in (out, ros1):
        found = counts(path)
        assert set(found) >= OUTPUTS
        assert {found[topic] for topic in OUTPUTS} == {1}
    rosbag = shutil.which('rosbag')
    if rosbag is not None:
        plain = {k: v for k, v in os.environ.items() if not k.startswith('PYTHON')}
        told = subprocess.run(
            [rosbag, 'info', str(ros1)], capture_output=True, text=True, check=True, env=plain)
        assert all(topic in told.stdout for topic in OUTPUTS)


def test_a_truncated_recording_is_processed_up_to_the_cut_and_said(
    recording: Recording, tmp_path: Path
) -> None:
    bag = recording.write(tmp_path / 'in.bag', '16UC1')
    os.truncate(bag, bag.stat().st_size // 2)  # in the middle of the second of three frames
    summary = every_frame(bag, tmp_path / 'out', recording)
    assert (summary.pairs, summary.frames) == (1, 1)
    assert 'the bag is damaged' in summary.text()
    assert counts(tmp_path / 'out')['/pop/joints'] == 1


def test_far_apart_stamps_are_explained_and_accepted_with_the_slop_that_is_suggested(
    recording: Recording, tmp_path: Path
) -> None:
    frame = recording.scenes[1].frame
    bag = write_with_late_color(tmp_path / 'in.mcap', frame, late_ns=209_000_000)
    shutil.copy(recording.keypoints / f'{frame.stamp_ns}.json',
                recording.keypoints / f'{frame.stamp_ns + 209_000_000}.json')
    refused = every_frame(bag, tmp_path / 'refused', recording)
    assert (refused.pairs, refused.frames) == (0, 0)
    assert 'the nearest depth image is 0.209 s away' in refused.text()
    slop = re.search(r'accept it with slop ([\d.]+)', refused.text())
    assert slop is not None
    accepted = every_frame(bag, tmp_path / 'accepted', recording, float(slop[1]))
    assert (accepted.pairs, accepted.people) == (1, 1)


def write_with_late_color(path: Path, frame: RgbdFrame, late_ns: int) -> Path:
    """Write one frame whose colour image was taken later than its depth image."""
    from support.bags import CAMERA, DEPTH, write_bag
    from support.messages import IMAGE, INFO, camera_info, depth_image, image
    late = frame.stamp_ns + late_ns
    return write_bag(path, [
        (COLOR, IMAGE, late, image(frame.rgb, 'rgb8', late)),
        (CAMERA, INFO, late + 1, camera_info(frame.camera, late)),
        (DEPTH, IMAGE, late + 2, depth_image(frame.depth_m, '32FC1', frame.stamp_ns)),
    ])


@pytest.mark.parametrize(('arguments', 'told'), [
    (['missing.bag'], 'missing.bag'),
    (['in.mcap', '--color', '/other'], 'expected topic /other'),
    (['in.mcap', '--keypoints', 'nothing.onnx'], 'nothing.onnx'),
])
def test_a_bad_request_is_one_sentence_and_leaves_nothing_behind(
    recording: Recording, tmp_path: Path, arguments: list[str], told: str
) -> None:
    write_frames(tmp_path / 'in.mcap', [recording.scenes[0].frame], '16UC1').rename(
        tmp_path / 'in.mcap')
    bag, *rest = arguments
    done = pop_replay(tmp_path / bag, '--out', tmp_path / 'out', '--every-frame', *rest)
    assert done.returncode == 2, done.stdout + done.stderr
    assert told in done.stderr
    assert 'Traceback' not in done.stderr
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize('name', ['2019-05-03-12-41-38.bag', '2019-05-03-12-41-38_mcap'])
def test_the_standing_man_of_a_real_robot_s_recording_is_fitted(tmp_path: Path, name: str) -> None:
    bag = SHARED / 'bags' / name
    for path in (bag, POSENET):
        if not path.exists():
            pytest.skip(f'looked for {path}')
    summary = every_frame(bag, tmp_path / 'out', POSENET, slop_s=0.4)
    assert summary.frames == 1
    with BagReader(tmp_path / 'out') as out:
        joints, = (m.read() for m in out.messages(['/pop/joints']))
    p = np.array([[q.position.x, q.position.y, q.position.z] for q in joints.poses[:24]])
    # Measured depth of his belly is 1.95 m; nearest person first.
    assert 1.9 < p[0, 2] < 2.25
    assert abs(p[0, 0]) < 0.25
    head, pelvis, knees = p[15], p[0], p[[4, 5]]
    assert head[1] < pelvis[1] - 0.4  # y points down: he stands upright
    assert np.all(knees[:, 1] > pelvis[1] + 0.25)


def test_frames_keep_their_order_and_number_without_a_node(
    recording: Recording, tmp_path: Path
) -> None:
    bag = recording.write(tmp_path / 'in.db3', '32FC1')
    summary = every_frame(bag, tmp_path / 'out', recording)
    assert (summary.messages, summary.pairs, summary.frames) == (9, 3, 3)
    with BagReader(tmp_path / 'out') as out:
        stamps = [m.time_ns for m in out.messages(['/pop/joints'])]
    assert stamps == [stamp + 1 for stamp in recording.stamps]  # when colour was recorded
