"""`pop viewer`: bodies of another process come back as the meshes they are poses of."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import rclpy
import yaml
from rclpy.executors import SingleThreadedExecutor
from support import bodies_sender
from support.estimates import estimate
from support.message_packages import environment_with
from support.node import ROOT, RunningNode
from support.recording import record
from visualization_msgs.msg import Marker

from pop_core.body.default_body import default_body
from pop_ros.from_messages import stamp_ns
from pop_ros.recorded_bodies import mesh_vertices
from pop_ros.viewer_command import parse_arguments

PEOPLE = (3, 8)
MESH, NODE_MESH = '/pop_viewer/mesh', '/pop/mesh'


@pytest.fixture
def packages(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in environment_with('pop_msgs').items():
        monkeypatch.setenv(name, value)


@contextmanager
def sender(digest: str) -> Iterator[None]:
    process = subprocess.Popen(
        [sys.executable, bodies_sender.__file__, digest, *map(str, PEOPLE)])
    try:
        yield
    finally:
        process.kill()
        process.wait()


class Watcher:
    """A process that rviz could be: collects markers by topic."""

    def __init__(self, *topics: str) -> None:
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        node = rclpy.create_node('watcher', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(node)
        self.found: dict[str, list[Marker]] = {topic: [] for topic in topics}
        for topic in topics:
            node.create_subscription(Marker, topic, self.found[topic].append, 10)

    def wait(self, done: Callable[[], bool], timeout_s: float) -> None:
        end_s = time.monotonic() + timeout_s
        while not done() and time.monotonic() < end_s:
            self._executor.spin_once(timeout_sec=0.1)

    def end(self) -> None:
        self._executor.shutdown()
        rclpy.shutdown(context=self._context)


@pytest.fixture
def watcher() -> Iterator[Watcher]:
    made = Watcher(MESH, NODE_MESH)
    yield made
    made.end()


def corners(marker: Marker) -> np.ndarray:
    return np.array([[p.x, p.y, p.z] for p in marker.points])


@pytest.mark.usefixtures('packages')
def test_meshes_rebuilt_in_another_process_are_those_of_the_estimates(watcher: Watcher) -> None:
    model, found = default_body(), watcher.found[MESH]
    viewer = RunningNode(module='pop_ros.viewer_command')
    with sender('same'):
        # Discovery may finish between two markers of one frame.
        watcher.wait(lambda: len(found) >= 3 * len(PEOPLE), timeout_s=30)
        # What cannot be posed is named, not drawn.
        viewer.wait_for('body 77: expected finite parameters', timeout_s=20)
    assert viewer.end() == 0, viewer.output
    assert 'Traceback' not in viewer.output
    assert {marker.id for marker in found} == set(PEOPLE), viewer.output
    for marker in found:
        assert stamp_ns(marker.header) == bodies_sender.STAMP_NS
        assert marker.header.frame_id == bodies_sender.FRAME_ID
        # float32 parameters: a micrometre per metre and radian.
        np.testing.assert_allclose(
            mesh_vertices(corners(marker), model.f), estimate(model, marker.id).vertices,
            atol=1e-5)


@pytest.mark.usefixtures('packages')
def test_a_node_s_meshes_and_the_viewer_s_are_the_same(watcher: Watcher, tmp_path: Path) -> None:
    recording = record(tmp_path, n_frames=2, rate_hz=1.0)
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    node = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints))
    viewer = RunningNode(module='pop_ros.viewer_command')
    node.wait_for('ready after')
    viewer.wait_for('as here')
    replay = subprocess.Popen(
        [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--out', str(tmp_path / 'out'),
         '--node-running'], stdout=subprocess.DEVNULL)
    watcher.wait(lambda: all(len(found) >= 2 for found in watcher.found.values()), timeout_s=60)
    replay.wait(60)
    assert node.end() == viewer.end() == 0, node.output + viewer.output
    rebuilt = {(m.id, stamp_ns(m.header)): m for m in watcher.found[MESH] if m.action == m.ADD}
    direct = {(m.id, stamp_ns(m.header)): m for m in watcher.found[NODE_MESH]
              if m.action == m.ADD}
    both = rebuilt.keys() & direct.keys()
    assert both, f'{list(rebuilt)} {list(direct)}\n{viewer.output}'
    for key in both:
        np.testing.assert_allclose(corners(rebuilt[key]), corners(direct[key]), atol=1e-5)
        assert rebuilt[key].color == direct[key].color


@pytest.mark.usefixtures('packages')
def test_bodies_of_another_model_are_refused_with_a_sentence(watcher: Watcher) -> None:
    viewer = RunningNode(module='pop_ros.viewer_command')
    with sender('0123456789abcdef'):
        viewer.wait_for('0123456789abcdef', timeout_s=30)
        watcher.wait(lambda: bool(watcher.found[MESH]), timeout_s=3)
    assert viewer.end() == 0, viewer.output
    assert watcher.found[MESH] == []
    assert 'start the viewer with the file of the node' in viewer.output


@pytest.mark.parametrize('flag', ['--body', '--model'])
def test_the_node_s_body_is_named_as_for_the_node_or_as_it_used_to_be(flag: str) -> None:
    assert parse_arguments([flag, 'smpl.npz']).body == Path('smpl.npz')


def test_the_rviz_configuration_shows_the_viewer_s_meshes_and_nothing_large_of_the_node() -> None:
    text = (ROOT / 'rviz' / 'pop_viewer.rviz').read_text(encoding='utf-8')
    displays = yaml.safe_load(text)['Visualization Manager']['Displays']
    topics = [display['Topic']['Value'] for display in displays if 'Topic' in display]
    assert topics == ['/pop_viewer/mesh', '/pop/joints']


def test_without_the_messages_it_says_what_is_missing() -> None:
    done = subprocess.run(
        [sys.executable, '-m', 'pop_ros.cli', 'viewer'], capture_output=True, text=True,
        timeout=60, check=False, cwd=ROOT)
    if 'pop_msgs' not in done.stderr:
        pytest.skip('pop_msgs is installed here')
    assert done.returncode == 2
    assert done.stderr.startswith('pop viewer: expected the package pop_msgs, found none')
    assert len(done.stderr.splitlines()) == 1
