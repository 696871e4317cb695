"""The node's life cycle and services, over DDS, in the order in which a manager uses them."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.qos import ReliabilityPolicy, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger
from support.node import ROOT, RunningNode
from support.player import Player
from support.recording import Recording, record
from visualization_msgs.msg import Marker

from pop_ros.diagnostics import read_values
from pop_ros.frame_folder import load_frame
from pop_ros.to_messages import make_header


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=1, rate_hz=1.0)


@pytest.fixture
def start() -> Iterator[Callable[..., RunningNode]]:
    """Start nodes, none of which outlives a test that fails."""
    nodes: list[RunningNode] = []

    def begin(*arguments: str) -> RunningNode:
        nodes.append(RunningNode(*arguments))
        return nodes[-1]

    yield begin
    for node in nodes:
        if node.process.poll() is None:
            node.process.kill()


def flags(recording: Recording) -> list[str]:
    return ['--keypoints', 'json', '--keypoints-dir', str(recording.keypoints)]


def state(player: Player) -> str:
    return str(player.call(GetState, 'get_state', GetState.Request()).current_state.label)


def change(player: Player, transition: str) -> bool:
    request = ChangeState.Request()
    request.transition.label = transition
    return bool(player.call(ChangeState, 'change_state', request).success)


def children(running: RunningNode) -> set[str]:
    """Return the numbers of the processes that the node has started."""
    tasks = Path(f'/proc/{running.process.pid}/task').glob('*/children')
    return {number for task in tasks for number in task.read_text().split()}


def fit_one(player: Player, recording: Recording) -> None:
    """Play the frame until its person comes back."""
    assert player.spin_until(player.is_heard)
    for messages in player.received.values():
        messages.clear()
    player.play(recording.scenes[0].frame)
    assert player.spin_until(lambda: all(player.received.values()))


def test_a_manager_takes_the_node_through_its_life(
    recording: Recording, start: Callable[..., RunningNode]
) -> None:
    running = start(*flags(recording), '--ros-args', '-p', 'autostart:=false')
    with Player(joints=PoseArray, mesh=Marker) as player:
        assert state(player) == 'unconfigured'
        assert not change(player, 'activate')
        assert 'preparing' not in running.output
        assert change(player, 'configure')
        running.wait_for('ready after')
        assert state(player) == 'inactive'
        # Inactive, it does not touch the camera although somebody listens.
        assert not player.spin_until(player.is_heard, 1.0)
        assert change(player, 'activate')
        fit_one(player, recording)
        poses = player.received['joints'][0].poses
        assert len(poses) == 24
        # Who is shown is removed, since nobody will follow them any more.
        assert change(player, 'deactivate')
        assert player.spin_until(lambda: not player.is_heard())
        assert player.spin_until(lambda: player.received['mesh'][-1].action == Marker.DELETE)
        assert player.spin_until(lambda: not player.received['joints'][-1].poses)
        assert player.spin_until(lambda: children(running))
        assert change(player, 'cleanup')
        assert state(player) == 'unconfigured'
        assert not children(running)
        # A second life is like the first.
        assert change(player, 'configure')
        assert change(player, 'activate')
        fit_one(player, recording)
        assert change(player, 'shutdown')
        assert state(player) == 'finalized'
        assert not children(running)
        assert player.spin_until(lambda: player.received['mesh'][-1].action == Marker.DELETE)
        assert player.spin_until(lambda: not player.is_heard())
    assert running.end(signal.SIGTERM) == 0, running.output
    assert 'Traceback' not in running.output


def test_without_subscribers_the_camera_is_left_alone_and_qos_is_the_user_s(
    recording: Recording, start: Callable[..., RunningNode]
) -> None:
    running = start(
        *flags(recording), '--ros-args', '-p',
        'qos_overrides./pop/joints.publisher.reliability:=best_effort')
    with Player() as player:
        running.wait_for('ready after')
        assert not player.spin_until(player.is_heard, 1.0)
        heard: list[PoseArray] = []
        listener = player.node.create_subscription(
            PoseArray, '/pop/joints', heard.append, qos_profile_sensor_data)
        assert player.spin_until(player.is_heard)
        player.play(recording.scenes[0].frame)
        assert player.spin_until(lambda: heard)
        offer, = player.node.get_publishers_info_by_topic('/pop/joints')
        assert offer.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
        player.node.destroy_subscription(listener)
        assert player.spin_until(lambda: not player.is_heard())
    assert running.end() == 0


@pytest.mark.parametrize(('arguments', 'told'), [
    (['--keypoints', 'json', '--keypoints-dir', '/nowhere'], 'keypoints: expected a folder'),
    (['--body', '/nowhere.npz'], '/nowhere.npz: expected a body model file'),
])
def test_configuring_without_a_file_fails_with_a_sentence_and_the_node_stays(
    start: Callable[..., RunningNode], arguments: list[str], told: str
) -> None:
    running = start(*arguments, '--ros-args', '-p', 'autostart:=false')
    with Player() as player:
        assert not change(player, 'configure')
        assert state(player) == 'unconfigured'
        running.wait_for(f'not configured: {told}')
    assert running.end() == 0


def test_simulated_time_says_how_old_images_of_a_recording_are(
    recording: Recording, start: Callable[..., RunningNode]
) -> None:
    running = start(*flags(recording), '--ros-args', '-p', 'use_sim_time:=true')
    stamp = recording.stamps[0]
    now = make_header(stamp + 250_000_000, '').stamp
    values: dict[str, str] = {}
    with Player(joints=PoseArray) as player:
        player.node.create_subscription(
            DiagnosticArray, '/diagnostics',
            lambda message: values.update(read_values(message, '/pop') or {}), 10)
        clock = player.node.create_publisher(Clock, '/clock', 10)
        player.node.create_timer(0.05, lambda: clock.publish(Clock(clock=now)))
        # Nothing depends on time that passes: this clock stands still.
        fit_one(player, recording)
        assert player.spin_until(lambda: values.get('frames') == '1'), running.output
    assert values['age of the image when published'] == 'p50 250.0 ms, p95 250.0 ms'
    assert running.end() == 0, running.output


def test_services_act_on_what_is_shown_and_seen(
    recording: Recording, tmp_path: Path, start: Callable[..., RunningNode]
) -> None:
    shots = tmp_path / 'shots'
    running = start(
        *flags(recording), '--ros-args', '-p', f'snapshot.folder:={shots}')
    with Player(joints=PoseArray, mesh=Marker) as player:
        early = player.call(Trigger, 'snapshot', Trigger.Request())
        assert not early.success
        assert 'no frame has been fitted yet' in early.message
        fit_one(player, recording)
        first_id = player.received['mesh'][-1].id
        check_snapshot(player, shots, recording)
        # Disabled, the node unsubscribes and removes who is shown.
        assert player.call(SetBool, 'enable', SetBool.Request(data=False)).success
        assert player.spin_until(lambda: not player.is_heard())
        assert player.spin_until(lambda: player.received['mesh'][-1].action == Marker.DELETE)
        assert player.received['mesh'][-1].id == first_id
        assert player.call(SetBool, 'enable', SetBool.Request(data=True)).success
        assert player.call(Trigger, 'reset', Trigger.Request()).success
        fit_one(player, recording)
    assert running.end() == 0, running.output


def check_snapshot(player: Player, shots: Path, recording: Recording) -> None:
    """Check that `pop fit` repeats at a desk what the node found."""
    answer = player.call(Trigger, 'snapshot', Trigger.Request())
    assert answer.success, answer.message
    folder = Path(answer.message)
    assert folder.parent == shots
    frame = load_frame(folder)
    np.testing.assert_array_equal(frame.rgb, recording.scenes[0].frame.rgb)
    found = np.load(folder / 'result' / 'person_0.npz')
    again = shots / 'again'
    command = [sys.executable, '-m', 'pop_ros.cli', 'fit', str(folder), '--out', str(again)]
    subprocess.run(command, check=True, cwd=ROOT, capture_output=True)
    repeated = np.load(again / folder.name / 'person_0.npz')
    # Keypoints and depth are rounded on their way through files.
    np.testing.assert_allclose(repeated['joints'], found['joints'], atol=0.02)


def stopped(main: str, number: signal.Signals, delay_s: float) -> tuple[int, str]:
    """Start a program, send a signal soon after; return its exit code and what it complained."""
    # Python itself must have started: before that no program can catch anything. Whoever runs the
    # tests in the background of a shell hands down that Ctrl-C is ignored.
    code = (
        'import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); '
        f'sys.path.insert(0, {str(ROOT)!r}); print("up", flush=True); {main}')
    process = subprocess.Popen(
        [sys.executable, '-c', code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == 'up\n'
    time.sleep(delay_s)
    process.send_signal(number)
    try:
        _, errors = process.communicate(timeout=30)
    finally:
        process.kill()  # a node that goes on would answer the tests that follow
    return process.returncode, errors


@pytest.mark.parametrize('delay_s', [0.15, 0.4, 0.8])
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_modules_are_imported_ends_the_node_cleanly(
    recording: Recording, number: signal.Signals, delay_s: float
) -> None:
    main = f'import pop_ros.node as n; sys.exit(n.main({flags(recording)!r}))'
    code, errors = stopped(main, number, delay_s)
    assert code == 0, errors
    assert 'Traceback' not in errors


@pytest.mark.parametrize('delay_s', [0.05, 0.2, 0.4, 0.8])
def test_ctrl_c_while_the_command_line_loads_leaves_no_traceback(
    recording: Recording, delay_s: float
) -> None:
    main = f'from pop_ros.__main__ import main; sys.argv[1:] = {["node", *flags(recording)]!r}; '
    code, errors = stopped(f'{main} main()', signal.SIGINT, delay_s)
    assert code in (0, 130), errors
    assert 'Traceback' not in errors


def test_a_start_with_cold_caches_says_what_takes_so_long_and_can_be_ended(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    start: Callable[..., RunningNode],
) -> None:
    monkeypatch.setenv('NUMBA_CACHE_DIR', str(tmp_path))
    running = start(*flags(recording))
    running.wait_for('compiling kernels of')
    assert 'about a minute, once' in running.output
    assert running.end() == 0, running.output
    assert 'Traceback' not in running.output
