"""What the ROS side costs: messages out, images in, and the way from camera to mesh.

    python -m benchmarks node [PART ...] [--people 1 3] [--seconds 20] [--keypoints SOURCE]
                              [--json FILE]
    python -m benchmarks node soak --minutes 10

Parts: messages (build and publish, per topic), inputs (pair and decode one VGA pair), latency (a
camera at 30 Hz in one process, the node in another; image sent to mesh received), soak (the same
for minutes: does memory or latency grow, does the node end?). Without any, all but soak.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.serialization import deserialize_message, serialize_message
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from sensor_msgs.msg import Image

from benchmarks.node_camera import FRAME_ID, KINDS, as_messages
from benchmarks.node_live import measure_latency, soak
from pop_core.body.default_body import default_body
from pop_core.body.kinematics import joint_rotations
from pop_core.estimate import BodyEstimate, FrameResult
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.body_messages import OUTPUT_TYPES, BodyMessages
from pop_ros.dds_profile import use_large_shared_memory
from pop_ros.from_messages import frame_from_messages
from pop_ros.inputs import COLOR, DEPTH, INFO
from pop_ros.node_config import NodeConfig
from pop_ros.pairing import FramePairer
from pop_ros.qos import output_qos

Rows = list[dict[str, object]]
REPEATS = 30


def run(arguments: list[str]) -> int:
    """Run the parts asked for, print their tables, write JSON when asked to."""
    parser = argparse.ArgumentParser(
        prog='python -m benchmarks node', description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        'parts', nargs='*', help='messages, inputs, latency, soak; without any, all but soak')
    parser.add_argument(
        '--people', type=int, nargs='+', default=[1, 3], choices=KINDS, help='people seen')
    parser.add_argument('--seconds', type=float, default=20.0, help='duration of latency')
    parser.add_argument(
        '--keypoints', default='json', metavar='SOURCE',
        help="as `pop node` names it; 'json' stands for those of the film, which cost nothing")
    parser.add_argument('--minutes', type=float, default=10.0, help='duration of soak')
    parser.add_argument('--json', type=Path, help='file to write the figures into')
    options = parser.parse_args(arguments)
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    use_large_shared_memory()
    console, good = Console(), True
    parts: dict[str, Callable[[], Rows]] = {
        'messages': lambda: measure_messages(one_walker()),
        'inputs': lambda: measure_inputs(one_walker().frame),
        'latency': lambda: [
            measure_latency(n, options.seconds, options.keypoints) for n in options.people],
    }
    results = {}
    for name in options.parts or parts:
        if name == 'soak':
            row, good = soak(
                options.people[0], options.minutes, options.keypoints,
                lambda row: console.print(
                    ', '.join(f'{key} {value}' for key, value in row.items()), markup=False))
            results[name] = [row]
        else:
            results[name] = parts[name]()
        console.print(table(name, results[name]))
    console.print(machine())
    if options.json is not None:
        options.json.write_text(json.dumps(results, indent=1), encoding='utf-8')
    return 0 if good else 1


def one_walker() -> SyntheticScene:
    """Return a scene of one person."""
    scene, = synthesise_sequence(default_body(), 4, 1)
    return scene


def machine() -> str:
    """Return what figures depend on."""
    return (f'{os.cpu_count()} processors ({platform.machine()}), Python '
            f'{platform.python_version()}, '
            f'{rclpy.get_rmw_implementation_identifier()}, load {os.getloadavg()[0]:.1f}')


def measure_messages(scene: SyntheticScene) -> Rows:
    """Return the time to build and to publish every output of one person, with a subscriber."""
    rclpy.init()
    node = rclpy.create_node('benchmark')
    messages = BodyMessages(default_body(), NodeConfig())
    result = FrameResult((truth_as_estimate(scene),), (), {})
    rows: Rows = []
    for name, kind in OUTPUT_TYPES.items():
        publisher = node.create_publisher(kind, f'~/{name}', output_qos())
        node.create_subscription(kind, f'~/{name}', lambda _: None, output_qos(), raw=True)

        def build(wanted: str = name) -> Any:
            (_, message), = messages.build(result, scene.frame, FRAME_ID, (wanted,))
            return message

        message = build()
        rows.append({
            'topic': f'~/{name}', 'bytes': size(message), 'build [ms]': milliseconds(build),
            'publish [ms]': milliseconds(lambda p=publisher, m=message: p.publish(m))})
    node.destroy_node()
    rclpy.shutdown()
    return rows


def size(message: Any) -> int:
    """Return how many bytes of a message, or of its serialised form, are sent."""
    return len(message if isinstance(message, bytes) else serialize_message(message))


def measure_inputs(frame: RgbdFrame) -> Rows:
    """Return the time to pair and to decode one pair of images."""
    messages = as_messages(frame)
    color, depth, info = messages[COLOR], messages[DEPTH], messages[INFO]
    data = bytes(serialize_message(color)), bytes(serialize_message(depth))
    pairer: FramePairer[Any] = FramePairer(30_000_000)
    stamps = iter(range(0, 10**12, 33_333_333))

    def pair() -> None:
        stamp = next(stamps)
        pairer.add_color(stamp, color, stamp)
        pairer.add_depth(stamp, depth, stamp)

    def deserialise() -> None:
        for serialised in data:
            deserialize_message(serialised, Image)

    return [
        {'step': 'deserialise both images', 'time [ms]': milliseconds(deserialise)},
        {'step': 'pair', 'time [ms]': milliseconds(pair)},
        {'step': 'decode rgb8 and 16UC1',
         'time [ms]': milliseconds(lambda: frame_from_messages(color, depth, info))},
    ]


def truth_as_estimate(scene: SyntheticScene) -> BodyEstimate:
    """Return the true person as if fitted."""
    person, = scene.people
    return BodyEstimate(
        person.parameters, person.vertices, person.joints,
        joint_rotations(default_body(), person.parameters), person.joint_state,
        np.tile(np.eye(3) * 1e-4, (24, 1, 1)), person.mask, 1.0)


def milliseconds(work: Callable[[], object]) -> float:
    """Return the median time of a function [ms], after a first call."""
    work()
    times = []
    for _ in range(REPEATS):
        started = time.perf_counter()
        work()
        times.append(time.perf_counter() - started)
    return round(1e3 * float(np.median(times)), 2)


def table(title: str, rows: Rows) -> Table:
    """Return rows of equal keys as a table."""
    made = Table(title=title)
    for key in rows[0]:
        made.add_column(escape(key))  # units stand in brackets
    for row in rows:
        made.add_row(*(str(value) for value in row.values()))
    return made
