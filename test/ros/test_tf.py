"""TF out and in, with the one message of tf2_msgs built from test/support/tf2_msgs."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from support.camera import START_NS, STEP_NS, CameraPlan, start_camera
from support.message_packages import environment_with
from support.messages import FRAME_ID
from support.node import RunningNode
from support.player import Listener
from support.recording import record

from pop_ros.diagnostics import read_values

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


BROADCASTER = '''
import rclpy
from geometry_msgs.msg import Quaternion, Transform, TransformStamped
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
rclpy.init()
node = rclpy.create_node('broadcaster')
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
transform = TransformStamped(child_frame_id='depth')
transform.header.frame_id = 'camera'
transform.transform.rotation.w = 1.0
node.create_publisher(TFMessage, '/tf_static', latched).publish(
    TFMessage(transforms=[TransformStamped(transform=Transform(rotation=Quaternion(w=0.0))),
                          transform]))
rclpy.spin(node)
'''


@pytest.mark.usefixtures('tf2_environment')
def test_depth_in_a_frame_of_its_own_is_registered_once_tf_tells_where_it_is(
    tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    plan = CameraPlan(frames=8, rate_hz=4.0, depth_frame='depth')
    for k in range(plan.frames):
        (tmp_path / f'{START_NS + k * STEP_NS}.json').write_text('{"version": 1.3, "people": []}')
    values: dict[str, str] = {}

    def on_report(message: DiagnosticArray) -> None:
        values.update(read_values(message, '/pop') or {})

    node = RunningNode('--keypoints', 'json', '--keypoints-dir', str(tmp_path))
    request.addfinalizer(node.end)
    with Listener(joints=PoseArray) as listener:
        listener.node.create_subscription(DiagnosticArray, '/diagnostics', on_report, 10)
        node.wait_for('ready after')
        for told in (False, True):
            if told:
                broadcaster = subprocess.Popen([sys.executable, '-c', BROADCASTER])
                request.addfinalizer(broadcaster.kill)
                listener.spin_until(lambda: False, 3.0)
            camera = start_camera(plan)
            expected = str(plan.frames * (2 if told else 1))
            assert listener.spin_until(
                lambda wanted=expected: values.get('pairs') == wanted
                and values['pending'] == '0', 60), values
            assert camera.wait(20) == 0
            assert (int(values['frames']) > 0) == told
    assert int(values['dropped: bad message']) == plan.frames
    assert 'no transform between them' in node.output
    assert '/tf_static: expected a translation and a unit quaternion' in node.output
