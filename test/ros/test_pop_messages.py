"""The messages of pop_msgs, built by scripts/build_messages.sh, between two processes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.node import ROOT, RunningNode
from support.recording import Recording, record

from pop_ros.bag_reader import BagReader
from pop_ros.pop_messages import joint_confidence

BUILD = Path(os.environ.get('POP_MSGS_BUILD', ROOT / 'build' / 'pop_msgs'))

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
    'states': [j.state for j in body.joints], 'confidence': [j.confidence for j in body.joints],
}))
'''


@pytest.fixture(scope='module')
def messages_path() -> dict[str, str]:
    """Return the environment in which pop_msgs is importable."""
    setup = BUILD / 'setup.sh'
    if not setup.is_file():
        pytest.skip(f'looked for {setup}: scripts/build_messages.sh builds pop_msgs '
                    '(needs g++ and python3-dev)')
    lines = subprocess.run(
        ['sh', '-c', f'. {setup}; env'], capture_output=True, text=True, check=True).stdout
    return dict(line.split('=', 1) for line in lines.splitlines() if '=' in line)


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=1, rate_hz=1.0)


def test_a_receiver_rebuilds_joints_from_the_published_parameters(
    messages_path: dict[str, str], recording: Recording, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch
) -> None:
    from pop_core.body.default_body import default_body
    from pop_core.body.joints import JOINT_NAMES
    from pop_core.body.kinematics import joints
    from pop_core.body.model import BodyParameters
    for name in ('PYTHONPATH', 'LD_LIBRARY_PATH', 'AMENT_PREFIX_PATH'):
        monkeypatch.setenv(name, messages_path.get(name, ''))
    bag = recording.write(tmp_path / 'in.mcap', '16UC1')
    node = RunningNode('--keypoints', 'json', '--keypoints-dir', str(recording.keypoints))
    listener = subprocess.Popen(
        [sys.executable, '-c', LISTENER], stdout=subprocess.PIPE, text=True)
    try:
        node.wait_for('ready after')
        out = tmp_path / 'out'
        play = [sys.executable, '-m', 'pop_ros.cli', 'replay', str(bag), '--out', str(out),
                '--node-running']
        environment = {**os.environ,
                       'PYTHONPATH': f'{ROOT}{os.pathsep}{os.environ["PYTHONPATH"]}'}
        done = subprocess.run(
            play, env=environment, capture_output=True, text=True, timeout=120, check=False)
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
    with BagReader(tmp_path / 'out') as written:
        assert {t.name: t.count for t in written.topics}['/pop/bodies'] == 1


def test_confidence_is_one_half_at_ten_centimetres_and_falls_with_variance() -> None:
    sigma_m = np.array([0.0, 0.02, 0.1, 0.5])
    confidence = joint_confidence(np.eye(3) * sigma_m[:, None, None] ** 2)
    assert confidence[0] == 1
    np.testing.assert_allclose(confidence[2], 0.5)
    assert np.all(np.diff(confidence) < 0)
