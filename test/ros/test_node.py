"""The node as a process: recordings over DDS in, bodies with the input's stamps out."""

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rclpy
from geometry_msgs.msg import PoseArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParameters
from sensor_msgs.msg import Image
from std_srvs.srv import SetBool, Trigger
from support.camera import CameraPlan, start_camera
from support.messages import FRAME_ID
from support.node import RunningNode
from support.recording import Recording, record, write_frames

from pop_core.rgbd import RgbdFrame
from pop_ros.bag_reader import BagReader
from pop_ros.from_messages import stamp_ns
from pop_ros.node_arguments import SourceArguments
from pop_ros.replay import ReplaySummary
from pop_ros.replay_pace import Pace
from pop_ros.replay_session import ReplayRequest, run_replay
from pop_ros.to_messages import CLOUD_TYPE

PELVIS_M = 0.05
PRECISION = 0.9
# Two frames are never lost, however slow the machine: one is fitted while the other waits.
RATE_HZ, SECONDS_PER_FRAME = 5.0, 1.0


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=2, rate_hz=RATE_HZ)


@pytest.fixture(scope='module')
def node(recording: Recording) -> Iterator[RunningNode]:
    # Each frame alone: what comes out of it does not depend on what was played before.
    running = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints),
                          '--ros-args', '-p', 'tracking.enabled:=false')
    running.wait_for('ready after')
    yield running
    assert running.end(signal.SIGINT) == 0, running.output
    assert 'Traceback' not in running.output


def replay(
    bag: Path, out: Path, recording: Recording, *, every_frame: bool = False
) -> ReplaySummary:
    request = ReplayRequest(
        bags=(bag,), out=out, ros1=None, sources=SourceArguments('json', recording.keypoints),
        topics=(None, None, None), slop_s=0.01,
        pace=Pace(rate=1 / (RATE_HZ * SECONDS_PER_FRAME)), every_frame=every_frame,
        node_running=True)
    return run_replay(request, lambda _text: None)


def read(path: Path, topic: str) -> list:
    """Return stamps and messages; they lie in the bag where the colour image lay in its bag."""
    with BagReader(path) as bag:
        found = [(m.time_ns, m.read()) for m in bag.messages([topic])]
    stamped = [(stamp_ns(message.header), message) for _, message in found]
    # The test's bags hold the three messages of a frame one nanosecond apart.
    assert all(0 <= time_ns - stamp <= 2
               for (time_ns, _), (stamp, _) in zip(found, stamped, strict=True))
    return stamped


def check_outputs(out: Path, recording: Recording) -> None:
    """Check that all three outputs have stamp and frame, and stand where the person stands."""
    for topic in ('/pop/mesh', '/pop/joints', '/pop/cloud'):
        found = read(out, topic)
        assert [stamp for stamp, _ in found] == recording.stamps, topic
        assert {m.header.frame_id for _, m in found} == {FRAME_ID}, topic
    for time_ns, poses in read(out, '/pop/joints'):
        assert len(poses.poses) == 24
        p = poses.poses[0].position
        assert np.linalg.norm([p.x, p.y, p.z] - recording.pelvis(time_ns)) < PELVIS_M
        quats = np.array([[q.orientation.x, q.orientation.y, q.orientation.z, q.orientation.w]
                          for q in poses.poses])
        np.testing.assert_allclose(np.linalg.norm(quats, axis=1), 1, atol=1e-9)
    for time_ns, cloud in read(out, '/pop/cloud'):
        check_cloud(cloud, recording, time_ns)
    for time_ns, marker in read(out, '/pop/mesh'):
        points = np.array([[p.x, p.y, p.z] for p in marker.points])
        assert len(points) % 3 == 0
        assert marker.color.a == 1.0
        # The pelvis lies inside the mesh.
        near = np.linalg.norm(points - recording.pelvis(time_ns), axis=1)
        assert 0.03 < near.min() < 0.25


def check_cloud(cloud: object, recording: Recording, time_ns: int) -> None:
    points = np.frombuffer(cloud.data.tobytes(), CLOUD_TYPE)
    frame = recording.scenes[recording.stamps.index(time_ns)].frame
    p_camera = np.column_stack([points['x'], points['y'], points['z']])
    u, v = np.rint(frame.camera.project(p_camera.astype(np.float64))).astype(int).T
    mask = recording.person_mask(time_ns)
    assert mask[v, u].mean() > PRECISION
    assert len(points) > 0.5 * np.sum(mask & np.isfinite(frame.depth_m))
    red = points['rgb'] >> 16 & 255
    assert np.array_equal(red, frame.rgb[v, u, 0])
    assert len(set(points['person'].tolist())) == 1


@pytest.mark.usefixtures('node')
@pytest.mark.parametrize(('suffix', 'encoding'), [
    ('.bag', '16UC1'), ('.db3', '32FC1'), ('.mcap', '16UC1')])
def test_a_replayed_recording_comes_back_as_bodies_where_the_person_stands(
    recording: Recording, tmp_path: Path, suffix: str, encoding: str
) -> None:
    bag = recording.write(tmp_path / f'in{suffix}', encoding)
    summary = replay(bag, tmp_path / 'out', recording)
    assert (summary.pairs, summary.frames, summary.people) == (2, 2, 2), summary.text()
    check_outputs(tmp_path / 'out', recording)


@pytest.mark.usefixtures('node')
def test_when_everybody_has_left_markers_go_and_then_nothing_is_published(
    recording: Recording, tmp_path: Path
) -> None:
    replay(recording.write(tmp_path / 'a.mcap', '16UC1'), tmp_path / 'before', recording)
    present = {marker.id for _, marker in read(tmp_path / 'before', '/pop/mesh')}
    bag = write_frames(tmp_path / 'b.mcap', empty_frames(recording, 2), '16UC1')
    summary = replay(bag, tmp_path / 'out', recording)
    assert (summary.frames, summary.people) == (2, 0), summary.text()
    (_, removal), = read(tmp_path / 'out', '/pop/mesh')
    assert removal.action == 2  # DELETE
    assert removal.id in present
    (_, joints), = read(tmp_path / 'out', '/pop/joints')
    assert not joints.poses
    (_, cloud), = read(tmp_path / 'out', '/pop/cloud')
    assert cloud.width == 0


def test_nothing_is_published_for_an_empty_scene(recording: Recording, tmp_path: Path) -> None:
    bag = write_frames(tmp_path / 'a.mcap', empty_frames(recording, 2), '16UC1')
    summary = replay(bag, tmp_path / 'out', recording, every_frame=True)
    assert (summary.pairs, summary.frames, summary.people) == (2, 2, 0)
    with BagReader(tmp_path / 'out') as found:
        counts = {topic.name: topic.count for topic in found.topics}
    assert {name: counts[name] for name in ('/pop/mesh', '/pop/joints', '/pop/cloud')} == {
        '/pop/mesh': 0, '/pop/joints': 0, '/pop/cloud': 0}


@pytest.mark.usefixtures('node')
def test_a_stamp_without_keypoints_is_a_counted_and_explained_drop(
    recording: Recording, tmp_path: Path
) -> None:
    frame = recording.scenes[0].frame
    alone = RgbdFrame(frame.rgb, frame.depth_m, frame.camera, frame.stamp_ns + 77)
    bag = write_frames(tmp_path / 'a.mcap', [alone], '16UC1')
    summary = replay(bag, tmp_path / 'out', recording)
    assert (summary.pairs, summary.frames) == (1, 0)
    assert dict(summary.drops) == {'no keypoints': 1}


def test_a_malformed_message_is_named_and_the_node_goes_on(
    node: RunningNode, recording: Recording, tmp_path: Path
) -> None:
    listener = ListeningProcess()
    camera = start_camera(CameraPlan(frames=4, rate_hz=4.0, break_frame=2))
    try:
        node.wait_for('found step 1')
        assert camera.wait(30) == 0
    finally:
        listener.end()
    assert 'expected 48 rows of at least 192 bytes' in node.output
    summary = replay(recording.write(tmp_path / 'a.mcap', '16UC1'), tmp_path / 'out', recording)
    assert summary.frames == 2


class ListeningProcess:
    """Somebody who subscribes an output: the node works for nobody else."""

    def __init__(self) -> None:
        code = ('import rclpy; from geometry_msgs.msg import PoseArray; rclpy.init(); '
                'node = rclpy.create_node("listener"); '
                'node.create_subscription(PoseArray, "/pop/joints", print, 10); rclpy.spin(node)')
        self._process = subprocess.Popen([sys.executable, '-c', code])

    def end(self) -> None:
        self._process.terminate()
        self._process.wait(10)


@pytest.mark.usefixtures('node')
def test_settings_are_described_and_refused_with_a_reason() -> None:
    rclpy.init()
    client = rclpy.create_node('client')
    try:
        describe = client.create_client(DescribeParameters, '/pop/describe_parameters')
        assert describe.wait_for_service(10)
        told = call(client, describe, DescribeParameters.Request(names=['sync.slop_s']))
        described, = told.descriptors
        assert described.type == ParameterType.PARAMETER_DOUBLE
        assert described.floating_point_range[0].to_value == 10.0
        assert 'stamps' in described.description
        assert '[s]' in described.description
        setter = client.create_client(SetParameters, '/pop/set_parameters')
        for name, value, reason in (
            ('sync.slop_s', ParameterValue(type=3, double_value=-1.0), 'out of range'),
            ('mesh.detail', ParameterValue(type=4, string_value='huge'), 'full, reduced, off'),
            ('max_people', ParameterValue(type=2, integer_value=0), 'out of range'),
        ):
            wish = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
            answer, = call(client, setter, wish).results
            assert not answer.successful
            assert reason in answer.reason
        accepted = ParameterValue(type=2, integer_value=3)
        wish = SetParameters.Request(parameters=[Parameter(name='max_people', value=accepted)])
        assert call(client, setter, wish).results[0].successful
    finally:
        client.destroy_node()
        rclpy.shutdown()


@pytest.mark.usefixtures('node')
def test_services_stop_the_work_start_it_again_and_start_ids_anew() -> None:
    rclpy.init()
    client = rclpy.create_node('client')
    client.create_subscription(PoseArray, '/pop/joints', lambda _: None, 5)
    camera = client.create_publisher(Image, 'color/image', 5)

    def listens(expected: bool) -> bool:
        end_s = time.monotonic() + 10
        while bool(camera.get_subscription_count()) != expected and time.monotonic() < end_s:
            rclpy.spin_once(client, timeout_sec=0.05)
        return bool(camera.get_subscription_count()) == expected

    try:
        enable = client.create_client(SetBool, '/pop/enable')
        reset = client.create_client(Trigger, '/pop/reset')
        assert enable.wait_for_service(10)
        assert reset.wait_for_service(10)
        assert listens(True)
        assert call(client, enable, SetBool.Request(data=False)).success
        assert listens(False)
        assert call(client, enable, SetBool.Request(data=True)).success
        assert listens(True)
        assert call(client, reset, Trigger.Request()).success
    finally:
        client.destroy_node()
        rclpy.shutdown()


def call(node: rclpy.node.Node, client: rclpy.client.Client, request: object) -> object:
    future = client.call_async(request)
    rclpy.spin_until_future_complete(node, future, timeout_sec=10)
    return future.result()


def test_the_node_ends_cleanly_on_sigterm_while_it_prepares(recording: Recording) -> None:
    running = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints))
    running.wait_for('preparing')
    assert running.end(signal.SIGTERM) == 0, running.output
    assert 'Traceback' not in running.output


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--ros-args', '-p', 'sync.slop_s:=-1.0'], 'sync.slop_s'),
    (['--ros-args', '-p', 'sync.slop_s:=1'], 'expected a float such as 0.03'),
    (['--ros-args', '-p', 'mesh.detail:=huge'], 'expected one of full, reduced, off'),
    (['--keypoints', 'json', '--keypoints-dir', '/nowhere'], '/nowhere'),
    (['--keypoints', 'none.onnx'], 'none.onnx'),
    (['--body', __file__], 'expected an npz archive'),
    (['--library', __file__], 'expected a pose library'),
])
def test_a_bad_setting_ends_the_node_with_a_sentence(arguments: list[str], told: str) -> None:
    running = RunningNode(*arguments)
    assert running.wait() == 2
    running.end()
    assert told in running.output
    assert 'Traceback' not in running.output


def empty_frames(recording: Recording, count: int) -> list[RgbdFrame]:
    """Return frames in which the keypoint source finds nobody."""
    first = recording.scenes[0].frame
    frames = []
    for k in range(count):
        stamp = first.stamp_ns + 1_000_000_000 + k * 200_000_000
        (recording.keypoints / f'{stamp}.json').write_text('{"version": 1.3, "people": []}')
        frames.append(RgbdFrame(first.rgb, first.depth_m, first.camera, stamp))
    return frames
