"""Inputs over DDS: a camera in another process, however it offers its topics."""

import subprocess
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from support.camera import START_NS, STEP_NS, CameraPlan, start_camera

from pop_ros.explanation import explain_missing_pairs
from pop_ros.frame_maker import FrameMaker
from pop_ros.from_messages import frame_from_messages, stamp_ns
from pop_ros.inputs import RgbdInputs, RgbdMessages
from pop_ros.message_error import BadMessageError
from pop_ros.qos import describe_qos, matched_qos, same_qos
from pop_ros.static_frames import StaticFrames

RELIABLE, BEST_EFFORT = ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT


class Receiver:
    """A node with inputs, as the real one has them."""

    def __init__(self, slop_s: float) -> None:
        self.node = Node('receiver')
        self.frames: list[RgbdMessages] = []
        self.inputs = RgbdInputs(self.node, slop_s, self.frames.append)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.node)
        self.node.create_timer(0.05, self.inputs.poll)
        self.follows = True
        self.node.create_timer(0.1, self.follow)

    def follow(self) -> None:
        if self.follows:
            self.inputs.follow('auto')

    def spin(self, timeout_s: float, done: Callable[[], bool] = lambda: False) -> bool:
        end_s = time.monotonic() + timeout_s
        while time.monotonic() < end_s and not done():
            self.executor.spin_once(timeout_sec=0.05)
        return done()

    def stamps(self) -> list[int]:
        return [stamp_ns(frame.color.header) for frame in self.frames]


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    rclpy.init()
    made = Receiver(slop_s=0.01)
    yield made
    made.executor.shutdown()
    made.node.destroy_node()
    rclpy.try_shutdown()


def receive(receiver: Receiver, plan: CameraPlan, count: int) -> None:
    """Let the camera play to its end and `count` frames have time to come."""
    camera = start_camera(plan)
    receiver.spin(30, lambda: camera.poll() is not None)
    receiver.spin(1.0, lambda: len(receiver.frames) >= count)
    finish(camera)


def finish(camera: subprocess.Popen[bytes]) -> None:
    assert camera.wait(10) == 0


@pytest.mark.parametrize(('reliable', 'info'), [
    (True, 'every'), (False, 'every'), (True, 'latched'), (False, 'late')])
def test_every_frame_arrives_however_the_camera_offers_it(
    receiver: Receiver, reliable: bool, info: str
) -> None:
    plan = CameraPlan(frames=8, reliable=reliable, info=info)
    receive(receiver, plan, 1 if info == 'late' else 8)
    expected = [START_NS + k * STEP_NS for k in range(8)]
    # Before the camera is known nothing can be fitted: the newest image waits for it.
    assert receiver.stamps() == (expected[-1:] if info == 'late' else expected)
    frame = receiver.frames[-1]
    assert frame_from_messages(frame.color, frame.depth, frame.info).depth_m[5, 5] == 2.0


def test_compressed_images_are_found_where_no_others_are_published(receiver: Receiver) -> None:
    receive(receiver, CameraPlan(frames=6, compressed=True), 6)
    assert receiver.stamps() == [START_NS + k * STEP_NS for k in range(6)]
    last = receiver.frames[-1]
    frame = frame_from_messages(last.color, last.depth, last.info)
    assert frame.depth_m[5, 5] == 2.0
    assert frame.rgb[5, 5].tolist() == [5, 5, 5]


def test_the_depth_camera_s_info_comes_with_depth_in_a_frame_of_its_own(
    receiver: Receiver
) -> None:
    receive(receiver, CameraPlan(frames=4, depth_frame='depth'), 4)
    last = receiver.frames[-1]
    maker = FrameMaker(StaticFrames())
    maker.extrinsics = np.eye(4)
    frame = maker.make(last.color, last.depth, last.info, last.depth_info)
    assert frame.depth_m[20, 20] == pytest.approx(2.0)
    with pytest.raises(BadMessageError, match='no transform between them'):
        FrameMaker(StaticFrames()).make(last.color, last.depth, last.info, last.depth_info)


def test_a_recording_that_loops_gives_every_pair_every_time(receiver: Receiver) -> None:
    plan = CameraPlan(frames=7, plays=3, depth_lag_ns=4_000_000)
    receive(receiver, plan, 21)
    expected = [START_NS + k * STEP_NS for k in range(7)] * 3
    assert sorted(receiver.stamps()) == sorted(expected)
    assert [frame.number for frame in receiver.frames] == list(range(1, 22))
    assert receiver.inputs.pairer.color_stream.jumps_back == 2


def test_stamps_beyond_the_slop_give_an_explanation_with_the_gap(
    receiver: Receiver
) -> None:
    plan = CameraPlan(frames=5, depth_lag_ns=-12_000_000)
    receiver.inputs.reset(slop_s=0.002)
    camera = start_camera(plan)
    receiver.spin(20, lambda: receiver.inputs.pairer.statistics.missed >= 3)
    text = explain_missing_pairs(receiver.inputs.reports(), receiver.inputs.pairer, 5.0)
    finish(camera)
    assert not receiver.frames
    missed = receiver.inputs.pairer.statistics.missed
    receiver.inputs.leave()
    assert receiver.inputs.pairer.statistics.missed == missed
    assert 'nearest depth image is 0.012 s away' in text
    assert '/color/image' in text
    assert 'camera (reliable)' in text


def test_a_topic_nobody_publishes_is_explained_with_what_there_is(
    receiver: Receiver
) -> None:
    other = receiver.node.create_publisher(
        type_of_image(), '/kinect/rgb/image', 10)
    receiver.spin(0.5)
    text = explain_missing_pairs(receiver.inputs.reports(), receiver.inputs.pairer, 5.0)
    assert 'color/image has no publisher' in text
    assert '-r color/image:=/kinect/rgb/image' in text
    receiver.node.destroy_publisher(other)


def test_leaving_unsubscribes_and_following_subscribes_again(receiver: Receiver) -> None:
    publisher = receiver.node.create_publisher(type_of_image(), 'color/image', 10)
    assert receiver.spin(5, lambda: publisher.get_subscription_count() == 1)
    receiver.follows = False
    receiver.inputs.leave()
    assert receiver.spin(5, lambda: publisher.get_subscription_count() == 0)
    receiver.follows = True
    assert receiver.spin(5, lambda: publisher.get_subscription_count() == 1)


def type_of_image() -> type:
    from sensor_msgs.msg import Image
    return Image


def profile(reliability: ReliabilityPolicy, *, latched: bool = False) -> QoSProfile:
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    return QoSProfile(depth=1, reliability=reliability, durability=durability)


def test_the_profile_is_the_strictest_that_every_publisher_satisfies() -> None:
    assert matched_qos([profile(RELIABLE)]).reliability == RELIABLE
    assert matched_qos([profile(RELIABLE), profile(BEST_EFFORT)]).reliability == BEST_EFFORT
    assert matched_qos([profile(BEST_EFFORT)], reliability='reliable').reliability == RELIABLE
    latched = [profile(RELIABLE, latched=True)]
    assert matched_qos(latched).durability == DurabilityPolicy.VOLATILE
    assert matched_qos(latched, latched=True).durability == DurabilityPolicy.TRANSIENT_LOCAL
    mixed = [*latched, profile(RELIABLE)]
    assert matched_qos(mixed, latched=True).durability == DurabilityPolicy.VOLATILE


def test_profiles_are_said_in_words() -> None:
    assert describe_qos(profile(BEST_EFFORT)) == 'best effort'
    assert describe_qos(profile(RELIABLE, latched=True)) == 'reliable, latched'
    assert not same_qos(profile(RELIABLE), profile(BEST_EFFORT))
