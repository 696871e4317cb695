"""Every form of images over DDS, from a camera in another process: read right, or named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray
from support.camera import CameraPlan, start_camera
from support.camera_cases import (
    BAD,
    BAD_COMPRESSED,
    CAMERA,
    COMPRESSED,
    DEPTH_M,
    GRAY,
    PLAIN,
    RGB,
    stamp_of,
    start_cases,
)
from support.node import RunningNode
from support.player import Listener

from pop_ros.diagnostics import read_values
from pop_ros.explanation import explain_missing_pairs
from pop_ros.frame_maker import FrameMaker
from pop_ros.inputs import RgbdInputs, RgbdMessages
from pop_ros.static_frames import StaticFrames

RATE_HZ = 3.0


def receive(names: list[str]) -> dict[int, RgbdMessages]:
    """Return what arrives of these cases by stamp, through the inputs of the node."""
    frames: list[RgbdMessages] = []
    with Listener() as player:
        inputs = RgbdInputs(player.node, 0.01, frames.append)
        player.node.create_timer(0.05, inputs.poll)
        player.node.create_timer(0.1, lambda: inputs.follow('auto'))
        camera = start_cases(names, RATE_HZ)
        player.spin_until(lambda: len(frames) == len(names), 60)
        assert camera.wait(20) == 0
    return {f.color.header.stamp.sec * 10**9 + f.color.header.stamp.nanosec: f for f in frames}


@pytest.mark.parametrize('cases', [PLAIN, COMPRESSED], ids=['plain', 'compressed'])
def test_every_encoding_and_camera_gives_the_same_scene(cases: dict[str, object]) -> None:
    names = list(cases)
    found = receive(names)
    assert sorted(found) == [stamp_of(k) for k in range(len(names))]
    maker = FrameMaker(StaticFrames())
    for k, name in enumerate(names):
        messages = found[stamp_of(k)]
        frame = maker.make(messages.color, messages.depth, messages.info)
        check_colour(name, frame.rgb)
        # Inverse depth is stored in steps of about 1 / 20000: half a millimetre at 3 m.
        atol = 5e-4 if name == 'quantised 32FC1' else 1e-6
        np.testing.assert_allclose(frame.depth_m, DEPTH_M, atol=atol, err_msg=name)
        np.testing.assert_allclose(frame.camera.K, CAMERA.K, atol=1e-9, err_msg=name)
        assert frame.camera.distortion_model == (
            name if name in ('plumb_bob', 'rational_polynomial', 'equidistant') else ''), name


def check_colour(name: str, rgb: np.ndarray) -> None:
    expected = np.broadcast_to(GRAY, RGB.shape) if name in ('mono8', '8UC1') else RGB
    atol = 12 if name in ('jpeg and png', 'quantised 32FC1') else 0  # JPEG of quality 98
    np.testing.assert_allclose(rgb.astype(int), expected.astype(int), atol=atol, err_msg=name)


@pytest.mark.parametrize(('good', 'bad'), [
    ('rgb8 and 16UC1', BAD), ('png and RVL', BAD_COMPRESSED)], ids=['plain', 'compressed'])
def test_every_bad_message_is_counted_and_named_and_the_node_goes_on(
    good: str, bad: dict[str, tuple[Callable[[], object], str]], tmp_path: Path,
    request: pytest.FixtureRequest,
) -> None:
    names = [name for case in bad for name in (case, good)]
    for k in range(len(names)):
        empty = json.dumps({'version': 1.3, 'people': []})
        (tmp_path / f'{stamp_of(k)}.json').write_text(empty, encoding='utf-8')
    values: dict[str, str] = {}

    def on_report(message: DiagnosticArray) -> None:
        values.update(read_values(message, '/pop') or {})

    running = RunningNode('--keypoints', 'json', '--keypoints-dir', str(tmp_path))
    request.addfinalizer(running.end)
    with Listener(joints=PoseArray) as player:
        player.node.create_subscription(DiagnosticArray, '/diagnostics', on_report, 10)
        running.wait_for('ready after')
        camera = start_cases(names, RATE_HZ)

        def is_counted() -> bool:
            return int(values.get('pairs', 0)) == len(names) and values['pending'] == '0'

        assert player.spin_until(is_counted, 60), values
        assert camera.wait(20) == 0
    assert running.end() == 0
    assert int(values['frames']) == len(bad), values
    assert int(values['dropped: bad message']) == len(bad), values
    for name, (_, told) in bad.items():
        assert told in running.output, name
    assert 'Traceback' not in running.output


@pytest.mark.parametrize('asked', ['auto', 'reliable', 'best_effort'])
@pytest.mark.parametrize('offered', ['reliable', 'best effort'])
def test_reliability_of_both_sides(offered: str, asked: str) -> None:
    mismatch = (offered, asked) == ('best effort', 'reliable')
    frames: list[RgbdMessages] = []
    with Listener() as player:
        inputs = RgbdInputs(player.node, 0.01, frames.append)
        player.node.create_timer(0.1, lambda: inputs.follow(asked))
        plan = CameraPlan(
            frames=60 if mismatch else 6, rate_hz=10.0, reliable=offered == 'reliable',
            listeners=0 if mismatch else 1)
        camera = start_camera(plan)
        if mismatch:
            player.spin_until(lambda: inputs.reports()[0].offers, 20)
            player.spin_until(lambda: False, 1.0)
            text = explain_missing_pairs(inputs.reports(), inputs.pairer, 5.0)
            assert 'input.reliability' in text
        else:
            assert player.spin_until(lambda: len(frames) == 6, 30)
        assert camera.wait(40) == 0
        assert len(frames) == (0 if mismatch else 6)
