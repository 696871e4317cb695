"""The messages of pop_msgs, built by scripts/build_messages.sh, between two processes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.message_packages import environment_with
from support.node import RunningNode
from support.recording import Recording, record

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_NAMES
from pop_core.body.kinematics import joints
from pop_core.body.model import BodyParameters
from pop_core.body.model_digest import model_digest
from pop_core.estimate import JointState, TrackState
from pop_ros.bag_reader import BagReader
from pop_ros.pop_messages import joint_confidence

# Prints what arrives on the latched ~/body_model and the first ~/bodies.
LISTENER = '''
import json, rclpy
from pop_msgs.msg import BodyArray, BodyModel
from rclpy.qos import DurabilityPolicy, QoSProfile
rclpy.init()
node = rclpy.create_node('listener')
found = {}
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
node.create_subscription(BodyModel, '/pop/body_model', lambda m: found.update(model=m), latched)
node.create_subscription(BodyArray, '/pop/bodies', lambda m: found.update(bodies=m), 5)
while len(found) < 2:
    rclpy.spin_once(node)
model, (body,) = found['model'], found['bodies'].bodies
print(json.dumps({
    'names': model.joint_names, 'faces': len(model.faces), 'vertices': model.vertex_count,
    'stamp': found['bodies'].header.stamp.sec * 10**9 + found['bodies'].header.stamp.nanosec,
    'joint': [body.joints[4].pose.position.x, body.joints[4].pose.position.y,
              body.joints[4].pose.position.z],
    'parameters': {n: getattr(body.parameters, n).tolist() for n in
                   ('transl', 'global_orient', 'body_pose')},
    'betas': list(body.parameters.betas), 'scale': body.parameters.scale,
    'digest': model.digest, 'visible': body.visible_fraction, 'track': body.track_state,
    'energies': dict(zip(body.energy_names, body.energies)), 'id': body.id,
    'covariance': [j.covariance.tolist() for j in body.joints],
    'states': [j.state for j in body.joints], 'confidence': [j.confidence for j in body.joints],
}))
'''


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=1, rate_hz=1.0)


def test_a_receiver_rebuilds_joints_from_the_published_parameters(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name, value in environment_with('pop_msgs').items():
        monkeypatch.setenv(name, value)
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    node = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints))
    listener = subprocess.Popen(
        [sys.executable, '-c', LISTENER], stdout=subprocess.PIPE, text=True)
    try:
        node.wait_for('ready after')
        out = tmp_path / 'out'
        play = [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--out', str(out),
                '--node-running']
        done = subprocess.run(play, capture_output=True, text=True, timeout=120, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        told, _ = listener.communicate(timeout=30)
    finally:
        listener.kill()
        code = node.end()
    assert code == 0, node.output
    found = json.loads(told)
    model = default_body()
    assert found['names'] == list(JOINT_NAMES)
    assert (found['faces'], found['vertices']) == (model.f.size, len(model.v_template))
    assert found['stamp'] == recording.stamps[0]
    parameters = BodyParameters(
        np.array(found['parameters']['transl']), np.array(found['parameters']['global_orient']),
        np.array(found['parameters']['body_pose']).reshape(23, 3), np.array(found['betas']),
        found['scale'])
    # float32 parameters: a micrometre per metre.
    np.testing.assert_allclose(joints(model, parameters)[4], found['joint'], atol=1e-5)
    assert set(found['states']) <= {0, 1, 2, 3, 4}
    assert all(0 < value <= 1 for value in found['confidence'])
    assert found['digest'] == model_digest(model)
    # float32 on the way, and again in the mean.
    np.testing.assert_allclose(
        found['visible'], np.mean(np.equal(found['states'], JointState.VISIBLE)), rtol=1e-6)
    covariance = np.reshape(found['covariance'], (24, 3, 3))
    np.testing.assert_allclose(found['confidence'], joint_confidence(covariance), rtol=1e-5)
    assert np.all(np.linalg.eigvalsh(covariance) > 0)
    assert found['track'] in {*TrackState, 255}
    assert found['energies']
    assert all(np.isfinite(list(found['energies'].values())))
    with BagReader(tmp_path / 'out') as written:
        assert {t.name: t.count for t in written.topics}['/pop/bodies'] == 1


def test_confidence_is_one_half_at_ten_centimetres_and_falls_with_variance() -> None:
    sigma_m = np.array([0.0, 0.02, 0.1, 0.5])
    confidence = joint_confidence(np.eye(3) * sigma_m[:, None, None] ** 2)
    assert confidence[0] == 1
    np.testing.assert_allclose(confidence[2], 0.5)
    assert np.all(np.diff(confidence) < 0)
