"""What ends a recording, as subscribers see it: loops, jumps back in time, another camera.

The camera of these tests publishes over DDS to a node in a process of its own.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import pytest
from support.node import RunningNode
from support.player import Player
from support.recording import Recording, record
from visualization_msgs.msg import Marker

from pop_core.rgbd import RgbdFrame
from pop_ros.from_messages import stamp_ns


@pytest.fixture(scope='module')
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(tmp_path_factory.mktemp('keypoints'), n_frames=4, rate_hz=15.0)


@pytest.fixture(scope='module')
def player(recording: Recording) -> Iterator[Player]:
    running = RunningNode(
        '--keypoints', 'json', '--keypoints-dir', str(recording.keypoints),
        '--ros-args', '-p', 'mesh.detail:=reduced')
    try:
        with Player(mesh=Marker) as made:
            assert made.spin_until(made.is_heard, 120), running.output
            yield made
        assert running.end() == 0, running.output
        assert 'Traceback' not in running.output
    finally:
        if running.process.poll() is None:
            running.process.kill()


def actions(player: Player, frame: RgbdFrame) -> dict[int, int]:
    """Play a frame; return what its markers do, by id."""
    markers = player.received['mesh']
    markers.clear()
    player.play(frame)
    assert player.spin_until(lambda: any(m.action == Marker.ADD for m in markers))
    assert {stamp_ns(marker.header) for marker in markers} == {frame.stamp_ns}
    return {marker.id: marker.action for marker in markers}


def shown(player: Player, frames: Sequence[RgbdFrame]) -> int:
    """Play frames that show one person under one number, and return it."""
    found = [actions(player, frame) for frame in frames]
    number, = {number for one in found for number, action in one.items() if action == Marker.ADD}
    return number


def ended(player: Player, before: int, frame: RgbdFrame) -> int:
    """Play a frame of another recording: the old number goes, a new one comes; return it."""
    found = actions(player, frame)
    number, = set(found) - {before}
    assert found == {before: Marker.DELETE, number: Marker.ADD}
    return number


def test_every_loop_of_a_recording_shows_its_person_under_a_new_number(
    player: Player, recording: Recording
) -> None:
    first, *others = [scene.frame for scene in recording.scenes]
    actions(player, first)
    number = shown(player, others)
    for _ in range(2):
        number = ended(player, number, first)
        assert shown(player, others) == number


def test_a_jump_back_in_time_begins_anew_wherever_it_lands(
    player: Player, recording: Recording
) -> None:
    frames = [scene.frame for scene in recording.scenes]
    actions(player, frames[0])
    number = shown(player, frames[1:])
    number = ended(player, number, frames[2])
    assert shown(player, frames[3:]) == number


def test_another_camera_begins_anew_though_time_goes_on(
    player: Player, recording: Recording
) -> None:
    frames = [scene.frame for scene in recording.scenes]
    actions(player, frames[0])
    number = shown(player, frames[1:2])
    camera = frames[0].camera
    other = replace(camera, fx=1.03 * camera.fx, fy=1.03 * camera.fy)
    strange = replace(frames[2], camera=other)
    player.announce(strange)
    number = ended(player, number, strange)
    assert shown(player, [replace(frames[3], camera=other)]) == number
