"""Look at what the node depends on and say what to do about what is missing."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from pop_ros.camera_presets import CAMERA_PRESETS
from pop_ros.interop import HRI_MISFIT, INTEROP, MISFITS
from pop_ros.pop_messages import pop_msgs
from pop_ros.qos import describe_qos
from pop_ros.tf_messages import tf2_msgs

DISCOVERY_S = 5.0  # at most; busy machines are slow to hear of each other
SETTLED_S = 1.5  # no further topic for so long: all are known
ECHO_S = 5.0
SHARED_MEMORY = Path('/dev/shm')
ENOUGH_SHARED_MEMORY = 100 * 2**20
IMAGE_TYPES = {'sensor_msgs/msg/Image', 'sensor_msgs/msg/CompressedImage'}


class Verdict(Enum):
    """How bad a finding is."""

    GOOD = 'ok'
    NOTE = 'note'
    BAD = 'bad'


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Args:
        subject: What.
        verdict: How it is.
        text: What was found.
        advice: What to do, or ''.
    """

    subject: str
    verdict: Verdict
    text: str
    advice: str = ''


def examine() -> Iterator[Finding]:
    """Yield findings one after the other; those about the ROS graph take some seconds."""
    yield shared_memory()
    yield profile()
    yield from message_packages()
    yield pose_library()
    yield kernels()
    yield networks()
    context = Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node('pop_doctor', context=context)
    try:
        yield middleware(node, context)
        yield from cameras(node)
    finally:
        node.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=context)


def shared_memory() -> Finding:
    """Return whether there is room for images in shared memory."""
    if not SHARED_MEMORY.is_dir():
        return Finding('shared memory', Verdict.NOTE, f'{SHARED_MEMORY} is missing',
                       'images go through the loopback device, more slowly')
    state = os.statvfs(SHARED_MEMORY)
    free = state.f_bavail * state.f_frsize
    text = f'{free / 2**20:.0f} MB free in {SHARED_MEMORY}'
    if free < ENOUGH_SHARED_MEMORY:
        return Finding('shared memory', Verdict.NOTE, text, 'docker run --shm-size=512m')
    return Finding('shared memory', Verdict.GOOD, text)


def profile() -> Finding:
    """Return whether Fast DDS uses shared memory that holds images."""
    file = os.environ.get('FASTRTPS_DEFAULT_PROFILES_FILE', '')
    if file and not Path(file).is_file():
        return Finding('Fast DDS profile', Verdict.BAD, f'{file} does not exist',
                       'correct FASTRTPS_DEFAULT_PROFILES_FILE')
    if file:
        return Finding('Fast DDS profile', Verdict.GOOD, file)
    return Finding(
        'Fast DDS profile', Verdict.NOTE, 'none: a best-effort camera loses half of its images',
        'export FASTRTPS_DEFAULT_PROFILES_FILE=.../config/fastdds_large_data.xml on both sides')


def message_packages() -> Iterator[Finding]:
    """Yield which optional message packages are installed."""
    for name, module, gain in (
        ('pop_msgs', pop_msgs, '~/bodies and ~/body_model (build msg_defs with colcon)'),
        ('tf2_msgs', tf2_msgs, 'TF frames (part of every ROS installation)'),
    ):
        if module is None:
            yield Finding(name, Verdict.NOTE, 'not installed', f'it would add {gain}')
        else:
            yield Finding(name, Verdict.GOOD, 'installed')
    yield packages_of_others()


def packages_of_others() -> Finding:
    """Return which packages are installed whose messages people are published in, too."""
    misfits = {interop.package: MISFITS[name] for name, interop in INTEROP.items()}
    misfits['hri_msgs'] = HRI_MISFIT
    fitting = [name for name, trouble in misfits.items() if not trouble]
    troubles = [trouble for trouble in misfits.values() if trouble and 'version' in trouble]
    if troubles:
        return Finding('other messages', Verdict.NOTE, '; '.join(troubles),
                       'their outputs are left away: docs/interoperability.md')
    none = f'none of {", ".join(misfits)} is needed'
    text = f'{", ".join(fitting)} installed' if fitting else none
    return Finding('other messages', Verdict.GOOD, text)


def pose_library() -> Finding:
    """Return whether the pose library has been generated already."""
    from pop_core.retrieval.default_library import cache_folder

    folder = cache_folder()
    found = sorted(folder.glob('*.poplib')) if folder.is_dir() else []
    if found:
        return Finding('pose library', Verdict.GOOD, f'{found[-1]}')
    return Finding('pose library', Verdict.NOTE, f'none in {folder}',
                   'the first start generates it, which takes about a minute')


def kernels() -> Finding:
    """Return whether numba has compiled the kernels already, and can keep them."""
    from pop_ros.kernel_cache import look_at_kernels

    cache = look_at_kernels()
    known = len(cache.cached) + len(cache.missing)
    text = f'{len(cache.cached)} of {known} modules are in the cache'
    if not cache.is_writable:
        return Finding('compiled kernels', Verdict.NOTE, f'{text}, which cannot be written',
                       'set NUMBA_CACHE_DIR to a folder of yours, or every start compiles them')
    if cache.missing:
        return Finding('compiled kernels', Verdict.NOTE, text,
                       'the first start compiles the others, which takes about a minute')
    return Finding('compiled kernels', Verdict.GOOD, text)


def networks() -> Finding:
    """Return which networks for keypoints have been fetched beside the embedded one."""
    from pop_ros.network_registry import load_registry, networks_folder

    found = [entry.name for entry in load_registry() if entry.path.is_file()]
    if found:
        return Finding('keypoint networks', Verdict.GOOD, ', '.join(found),
                       f'pop node --keypoints {found[0]}')
    return Finding('keypoint networks', Verdict.NOTE,
                   f'none in {networks_folder()}; the embedded one (depth) finds people coarsely',
                   'pop models list names better ones; files of yours and of OpenPose do as well')


def middleware(node: Node, context: Context) -> Finding:
    """Return whether a message makes its way through the middleware."""
    arrived: list[str] = []
    # A second participant, so that the message really travels.
    other = Context()
    rclpy.init(context=other, signal_handler_options=SignalHandlerOptions.NO)
    listener = Node('pop_doctor_listener', context=other)

    def hear(message: Any) -> None:
        arrived.append(message.data)

    listener.create_subscription(String, '~/echo', hear, 1)
    publisher = node.create_publisher(String, '/pop_doctor_listener/echo', 1)
    executor = SingleThreadedExecutor(context=other)
    executor.add_node(listener)
    started_s = time.monotonic()
    while not arrived and time.monotonic() - started_s < ECHO_S:
        publisher.publish(String(data='echo'))
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    listener.destroy_node()  # type: ignore[no-untyped-call]
    rclpy.shutdown(context=other)
    name = rclpy.get_rmw_implementation_identifier()  # type: ignore[attr-defined]
    domain = context.get_domain_id()
    if arrived:
        return Finding('middleware', Verdict.GOOD, f'{name}, domain {domain}')
    return Finding('middleware', Verdict.BAD, f'{name}, domain {domain}: no message came through',
                   'check firewall, ROS_AUTOMATIC_DISCOVERY_RANGE and FASTRTPS profile')


def cameras(node: Node) -> Iterator[Finding]:
    """Yield the image topics that are published, and the presets that fit them."""
    seen = _image_topics(node)
    for topic in sorted(seen):
        offers = {describe_qos(o.qos_profile) for o in node.get_publishers_info_by_topic(topic)}
        yield Finding('image topic', Verdict.GOOD, f'{topic} ({", ".join(sorted(offers))})')
    if not seen:
        yield Finding('image topic', Verdict.NOTE, 'none is published in this domain',
                      'start a camera driver, or play a bag')
    for name, preset in CAMERA_PRESETS.items():
        if preset.topics.color in seen and preset.topics.depth in seen:
            yield Finding('camera', Verdict.GOOD, f'{name} ({preset.driver})',
                          f'pop node --camera {name}')


def _image_topics(node: Node) -> set[str]:
    """Return the image topics that are published, once no further one is heard of."""
    seen: set[str] = set()
    started_s = changed_s = time.monotonic()
    while time.monotonic() - started_s < DISCOVERY_S:
        known = {topic for topic, kinds in node.get_topic_names_and_types()
                 if IMAGE_TYPES.intersection(kinds) and node.count_publishers(topic)}
        if known != seen:
            seen, changed_s = known, time.monotonic()
        if seen and time.monotonic() - changed_s > SETTLED_S:
            break
        time.sleep(0.1)
    return seen
