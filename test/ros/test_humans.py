"""REP-155 over DDS: bodies come and go below /humans, with ids, regions, skeletons and frames."""

import json
import os
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support import humans_sender
from support.estimates import CAMERA, estimate
from support.humans_sender import FRAME_ID, LEAVES, STAMP_NS, STAYS
from support.message_packages import environment_with
from support.node import RunningNode

from pop_core.body.default_body import default_body
from pop_core.body.joints import JOINT_INDEX
from pop_core.errors import SettingError
from pop_ros.interop import HRI_MISFIT
from pop_ros.node_config import NodeConfig

SENDER = humans_sender.__file__
LISTENER = SENDER.replace('sender', 'listener')  # imports messages that are not here
IDS = [f'front_pop_{number}' for number in (STAYS, LEAVES)]
PER_BODY = ('cropped', 'joint_states', 'roi', 'skeleton2d')


@pytest.fixture(scope='module')
def heard() -> dict[str, Any]:
    environment = environment_with('hri_msgs', 'tf2_msgs')
    sender = subprocess.Popen([sys.executable, SENDER], env=environment)
    try:
        done = subprocess.run([sys.executable, LISTENER], env=environment, capture_output=True,
                              text=True, timeout=70, check=False)
    finally:
        sender.kill()
        sender.wait()
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_bodies_are_listed_and_their_topics_go_with_them(heard: dict[str, Any]) -> None:
    assert heard['first'] == IDS
    assert heard['last'] == IDS[:1]
    tracked = '/humans/bodies/tracked'
    topics = [[f'/humans/bodies/{body}/{name}' for name in PER_BODY] for body in IDS]
    assert heard['before'] == sorted([*topics[0], *topics[1], tracked])
    assert heard['after'] == sorted([*topics[0], tracked])
    assert heard['off'] == []


def test_every_message_has_stamp_and_frame_of_the_image(heard: dict[str, Any]) -> None:
    assert set(heard['found']) == set(PER_BODY)
    for header in [heard['header'], *(m['header'] for m in heard['found'].values())]:
        assert header['stamp']['sec'] * 10**9 + header['stamp']['nanosec'] == STAMP_NS
        assert header['frame_id'] == FRAME_ID


def test_joint_names_end_with_the_body_s_id(heard: dict[str, Any]) -> None:
    states = heard['found']['joint_states']
    assert {'waist', 'l_elbow', 'r_knee', 'y_head'} <= {
        name.removesuffix(f'_{IDS[0]}') for name in states['name']}
    assert all(name.endswith(f'_{IDS[0]}') for name in states['name'])
    assert len(states['name']) == len(states['position']) == 20


def test_the_region_lies_around_the_skeleton(heard: dict[str, Any]) -> None:
    region, points = heard['found']['roi'], heard['found']['skeleton2d']['skeleton']
    for point in points:
        assert region['xmin'] <= point['x'] <= region['xmax']
        assert region['ymin'] <= point['y'] <= region['ymax']
    picture = heard['found']['cropped']
    width_px = (region['xmax'] - region['xmin']) * CAMERA.width
    assert abs(picture['width'] - width_px) < 2.5


def test_frames_hang_below_the_body_and_stand_where_its_joints_are(heard: dict[str, Any]) -> None:
    body = estimate(default_body(), STAYS)
    frames = [f for f in heard['frames'] if f['child_frame_id'].endswith(IDS[0])]
    root, *others = frames
    assert (root['header']['frame_id'], root['child_frame_id']) == (FRAME_ID, f'body_{IDS[0]}')
    assert {f['header']['frame_id'] for f in others} == {f'body_{IDS[0]}'}
    place, R = pose(root)
    hips = body.joints[[JOINT_INDEX['left_hip'], JOINT_INDEX['right_hip']]]
    np.testing.assert_allclose(place, hips.mean(axis=0))
    # Facing the camera, upright: forward is towards the camera, z is up, which is -y.
    assert R[2, 0] < -0.8
    assert R[1, 2] < -0.8
    by_name = {f['child_frame_id'].removesuffix(f'_{IDS[0]}'): pose(f)[0] for f in others}
    for link, joint in (('l_wrist', 'left_wrist'), ('r_ankle', 'right_ankle'),
                        ('torso', 'neck'), ('head', 'head')):
        np.testing.assert_allclose(
            place + R @ by_name[link], body.joints[JOINT_INDEX[joint]], atol=1e-9)


def pose(transform: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    p, q = transform['transform']['translation'], transform['transform']['rotation']
    R = Rotation.from_quat([q['x'], q['y'], q['z'], q['w']]).as_matrix()
    return np.array([p['x'], p['y'], p['z']]), R


def test_without_hri_msgs_the_parameter_is_refused_with_a_reason() -> None:
    if not HRI_MISFIT:
        pytest.skip('hri_msgs is installed here')
    with pytest.raises(SettingError, match='rep155: expected the messages of hri_msgs'):
        NodeConfig(rep155=True)
    node = RunningNode('--keypoints', 'json', '--keypoints-dir', os.curdir, '--ros-args', '-p',
                       'rep155:=true')
    assert node.wait() == 2
    assert 'hri_msgs is not installed' in node.output
