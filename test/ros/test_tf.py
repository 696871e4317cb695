"""TF frames of people, with the one message of tf2_msgs built from test/support/tf2_msgs."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.message_packages import environment_with
from support.messages import FRAME_ID
from support.node import RunningNode
from support.recording import record

LISTENER = '''
import json, rclpy
from tf2_msgs.msg import TFMessage
rclpy.init()
node = rclpy.create_node('listener')
found = []
node.create_subscription(TFMessage, '/tf', found.append, 10)
while not found:
    rclpy.spin_once(node)
print(json.dumps([{
    'parent': t.header.frame_id, 'child': t.child_frame_id,
    'stamp': t.header.stamp.sec * 10**9 + t.header.stamp.nanosec,
    'at': [t.transform.translation.x, t.transform.translation.y, t.transform.translation.z],
} for t in found[0].transforms]))
'''


@pytest.fixture
def tf2_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in environment_with('tf2_msgs').items():
        monkeypatch.setenv(name, value)


@pytest.mark.usefixtures('tf2_environment')
def test_frames_of_a_person_stand_where_the_person_stands(tmp_path: Path) -> None:
    recording = record(tmp_path, n_frames=1, rate_hz=1.0)
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    node = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints),
                       '--ros-args', '-p', 'tf.frames:=joints')
    listener = subprocess.Popen(
        [sys.executable, '-c', LISTENER], stdout=subprocess.PIPE, text=True)
    try:
        node.wait_for('ready after')
        done = subprocess.run(
            [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--out',
             str(tmp_path / 'out'), '--node-running'],
            capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        told, _ = listener.communicate(timeout=30)
    finally:
        listener.kill()
        code = node.end()
    assert code == 0, node.output
    frames = json.loads(told)
    assert len(frames) == 24
    assert {frame['parent'] for frame in frames} == {FRAME_ID}
    assert {frame['stamp'] for frame in frames} == set(recording.stamps)
    person, *joints = frames
    name = person['child']
    assert name.startswith('body_')
    assert all(frame['child'].startswith(f'{name}/') for frame in joints)
    assert np.linalg.norm(person['at'] - recording.pelvis(recording.stamps[0])) < 0.05
