"""Recordings played to a running node: again and again, step by step, with a clock."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image
from support.bags import COLOR, DEPTH
from support.node import ROOT, RunningNode
from support.recording import Recording, record, write_frames

from pop_ros.bag_reader import BagReader
from pop_ros.from_messages import stamp_ns
from pop_ros.replay_pace import BagClock, EnterKey

STEP_NS = 500_000_000


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=2, rate_hz=2.0)


@pytest.fixture(scope='module')
def node(recording: Recording) -> Iterator[RunningNode]:
    running = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints))
    running.wait_for('ready after')
    yield running
    assert running.end() == 0, running.output


class Listener:
    """Hears what a replay publishes: stamps of colour images, depth, and the clock."""

    def __init__(self) -> None:
        self.stamps: list[int] = []
        self.depths = 0
        self.clock: list[int] = []
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node('listener', context=self._context)
        self._node.create_subscription(
            Image, 'color/image', lambda m: self.stamps.append(stamp_ns(m.header)), 10)
        self._node.create_subscription(Image, 'depth/image', self._on_depth, 10)
        self._node.create_subscription(
            Clock, '/clock',
            lambda m: self.clock.append(m.clock.sec * 10**9 + m.clock.nanosec), 100)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def wait_for(self, done: Callable[[], bool], process: subprocess.Popen[str]) -> None:
        end_s = time.monotonic() + 60
        while not done():
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < end_s, (self.stamps, self.clock[-5:])
            self._executor.spin_once(timeout_sec=0.05)

    def hears(self) -> bool:
        """Return whether images and clock of a replay will arrive."""
        return all(map(self._node.count_publishers, ('color/image', 'depth/image', '/clock')))

    def clock_stands(self) -> bool:
        return len(self.clock) > 30 and len(set(self.clock[-20:])) == 1

    def _on_depth(self, _: Image) -> None:
        self.depths += 1
        self.clock.clear()  # it must stand after this frame, not before

    def close(self) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


@pytest.fixture
def listener() -> Iterator[Listener]:
    made = Listener()
    yield made
    made.close()


def play(bag: Path, out: Path, *arguments: str) -> subprocess.Popen[str]:
    """Play a bag to the node that runs; standard input is a pipe."""
    return subprocess.Popen(
        [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--node-running',
         '--out', str(out), *arguments],
        env={**os.environ, 'PYTHONPATH': str(ROOT)}, text=True, stdin=subprocess.PIPE,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def press_enter(process: subprocess.Popen[str], listener: Listener) -> None:
    """Let a frame pass once the listener has found the replay."""
    listener.wait_for(listener.hears, process)
    time.sleep(1.0)  # both sides must have found each other
    assert process.stdin is not None
    process.stdin.write('\n')
    process.stdin.flush()


def joints(bag: Path) -> list[int]:
    with BagReader(bag) as reader:
        return [stamp_ns(m.read().header) for m in reader.messages(['/pop/joints'])]


def test_a_loop_goes_on_until_ctrl_c_and_records_one_round(
    recording: Recording, node: RunningNode, listener: Listener, tmp_path: Path
) -> None:
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    process = play(bag, tmp_path / 'out', '--loop', '--rate', '0.5')
    listener.wait_for(lambda: len(listener.stamps) >= 5, process)
    process.send_signal(signal.SIGINT)
    said, complained = process.communicate(timeout=30)
    assert process.returncode == 0, complained
    assert 'Traceback' not in complained
    # Whoever joins late misses the beginning, and then sees every frame.
    assert all(a != b for a, b in pairwise(listener.stamps))
    assert set(listener.stamps) == set(recording.stamps)
    assert '2 frames fitted of 2 pairs (6 messages)' in said
    assert joints(tmp_path / 'out') == recording.stamps


def test_ctrl_c_keeps_what_was_fitted_so_far(
    recording: Recording, node: RunningNode, listener: Listener, tmp_path: Path
) -> None:
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    process = play(bag, tmp_path / 'out', '--step', '--clock')
    press_enter(process, listener)
    listener.wait_for(lambda: listener.depths == 1 and listener.clock_stands(), process)
    assert listener.stamps == recording.stamps[:1]
    process.send_signal(signal.SIGINT)
    said, complained = process.communicate(timeout=60)
    assert process.returncode == 130, complained
    assert 'ended by Ctrl-C' in said
    assert joints(tmp_path / 'out') == recording.stamps[:1], (said, complained)


def test_every_step_lets_one_frame_pass_while_the_clock_stands(
    recording: Recording, node: RunningNode, listener: Listener, tmp_path: Path
) -> None:
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    process = play(bag, tmp_path / 'out', '--step', '--clock')
    press_enter(process, listener)
    listener.wait_for(lambda: listener.depths == 1 and listener.clock_stands(), process)
    assert listener.stamps == recording.stamps[:1]
    first_ns, last_ns = recording.stamps
    # It stands before the next image; the depth beside that one may come first.
    assert first_ns <= listener.clock[-1] < last_ns + STEP_NS / 2
    assert process.stdin is not None
    process.stdin.close()  # Ctrl-D: everything else passes
    process.stdin = None  # or communicate() would close it again
    listener.wait_for(lambda: len(listener.stamps) == 2, process)
    said, complained = process.communicate(timeout=60)
    assert process.returncode == 0, complained
    assert 'Enter shows the next frame' in said
    assert all(a <= b for a, b in pairwise(listener.clock))
    assert joints(tmp_path / 'out') == recording.stamps
    assert listener.clock[-1] >= last_ns - STEP_NS


def test_the_clock_runs_at_the_rate_and_stands_while_paused() -> None:
    clock = BagClock(rate=50.0)
    assert clock.now_ns() is None
    clock.go_on(1_000)
    started_s = time.monotonic()
    time.sleep(0.05)
    found_ns = clock.now_ns()
    elapsed_ns = (time.monotonic() - started_s) * 1e9
    assert found_ns is not None
    assert 50 * 0.05e9 <= found_ns - 1_000 <= 50 * elapsed_ns + 1e6
    clock.pause()
    paused_ns = clock.now_ns()
    time.sleep(0.01)
    assert clock.now_ns() == paused_ns
    clock.go_on(7)  # where it stood, not there
    assert clock.now_ns() >= paused_ns
    clock.rewind()
    assert clock.now_ns() is None


def test_lines_pass_one_frame_each_and_the_end_of_input_all() -> None:
    reading, writing = os.pipe()
    key = EnterKey(reading)
    assert not key.may_pass()
    os.write(writing, b'\n\nhalf')
    assert [key.may_pass() for _ in range(3)] == [True, True, False]
    os.close(writing)
    assert [key.may_pass() for _ in range(3)] == [True] * 3
    os.close(reading)


def test_inputs_and_transforms_go_along_and_sqlite_holds_the_same(
    recording: Recording, node: RunningNode, tmp_path: Path
) -> None:
    bag = write_frames(tmp_path / 'in.db3', [recording.scenes[0].frame], '16UC1')
    process = play(bag, tmp_path / 'out', '--inputs', '--storage', 'sqlite3',
                   '--ros1', str(tmp_path / 'out.bag'))
    _, complained = process.communicate(timeout=60)
    assert process.returncode == 0, complained
    assert list((tmp_path / 'out').glob('*.db3'))
    with BagReader(bag) as original:
        expected = [m.data for m in original.messages([COLOR, DEPTH])]
    for written in (tmp_path / 'out', tmp_path / 'out.bag'):
        with BagReader(written) as found:
            assert [m.data for m in found.messages([COLOR, DEPTH])] == expected
            pair = [m.time_ns for m in found.messages([COLOR, '/pop/joints'])]
        assert pair[0] == pair[1]  # of one time: both bags can be played beside each other
