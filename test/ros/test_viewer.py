"""`pop viewer`: bodies of another process come back as the meshes they are poses of."""

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import rclpy
import yaml
from support import bodies_sender
from support.estimates import estimate
from support.message_packages import environment_with
from support.node import ROOT, RunningNode
from visualization_msgs.msg import Marker

from pop_core.body.default_body import default_body
from pop_ros.from_messages import stamp_ns
from pop_ros.recorded_bodies import mesh_vertices

PEOPLE = (3, 8)


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


def receive(topic: str, wanted: int, timeout_s: float) -> list[Marker]:
    """Return the first markers on a topic, fewer if the time is over."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('watcher', context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    found: list[Marker] = []
    node.create_subscription(Marker, topic, found.append, 10)
    end_s = time.monotonic() + timeout_s
    while len(found) < wanted and time.monotonic() < end_s:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    rclpy.shutdown(context=context)
    return found


@pytest.mark.usefixtures('packages')
def test_meshes_rebuilt_in_another_process_are_those_of_the_estimates() -> None:
    model = default_body()
    viewer = RunningNode(module='pop_ros.viewer_command')
    with sender('same'):
        # Discovery may finish between two markers of one frame.
        markers = receive('/pop_viewer/mesh', 3 * len(PEOPLE), timeout_s=30)
        # What cannot be posed is named, not drawn.
        viewer.wait_for('body 77: expected finite parameters', timeout_s=20)
    assert viewer.end() == 0, viewer.output
    assert 'Traceback' not in viewer.output
    assert {marker.id for marker in markers} == set(PEOPLE), viewer.output
    for marker in markers:
        assert stamp_ns(marker.header) == bodies_sender.STAMP_NS
        assert marker.header.frame_id == bodies_sender.FRAME_ID
        corners = np.array([[p.x, p.y, p.z] for p in marker.points])
        # float32 parameters: a micrometre per metre and radian.
        np.testing.assert_allclose(
            mesh_vertices(corners, model.f), estimate(model, marker.id).vertices, atol=1e-5)


@pytest.mark.usefixtures('packages')
def test_bodies_of_another_model_are_refused_with_a_sentence() -> None:
    viewer = RunningNode(module='pop_ros.viewer_command')
    with sender('0123456789abcdef'):
        viewer.wait_for('0123456789abcdef', timeout_s=30)
        markers = receive('/pop_viewer/mesh', 1, timeout_s=3)
    assert viewer.end() == 0, viewer.output
    assert markers == []
    assert 'start the viewer with the file of the node' in viewer.output


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
