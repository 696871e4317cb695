"""What the ROS side costs: messages out, images in, and the way from camera to mesh.

    python -m benchmarks node [PART ...] [--seconds 20] [--json FILE]

Parts: messages (build and publish, per topic), inputs (pair and decode one VGA pair), latency (a
camera at 30 Hz in one process, the node in another; stamp to mesh received).
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.serialization import deserialize_message
from rich.console import Console
from rich.table import Table

from pop_core.body.default_body import default_body
from pop_core.body.kinematics import joint_rotations
from pop_core.estimate import BodyEstimate, FrameResult
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.body_messages import OUTPUT_TYPES, BodyMessages
from pop_ros.from_messages import frame_from_messages
from pop_ros.image_messages import color_message, depth_message, info_message
from pop_ros.inputs import COLOR, DEPTH, INFO
from pop_ros.node_arguments import SourceArguments
from pop_ros.node_config import NodeConfig
from pop_ros.pairing import FramePairer
from pop_ros.qos import output_qos
from pop_ros.replay_node import NodeProcess
from pop_ros.to_messages import make_header

Rows = list[dict[str, object]]
RATE_HZ = 30.0
REPEATS = 30
FRAME_ID = 'camera_color_optical_frame'


def run(arguments: list[str]) -> int:
    """Run the parts asked for, print their tables, write JSON when asked to."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks node', description=__doc__)
    parser.add_argument('parts', nargs='*', help='messages, inputs, latency; without any, all')
    parser.add_argument('--seconds', type=float, default=20.0, help='duration of latency')
    parser.add_argument('--json', type=Path, help='file to write the figures into')
    options = parser.parse_args(arguments)
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
    scene, = synthesise_sequence(default_body(), 4, 1)
    parts: dict[str, Callable[[], Rows]] = {
        'messages': lambda: measure_messages(scene),
        'inputs': lambda: measure_inputs(scene.frame),
        'latency': lambda: measure_latency(scene, options.seconds),
    }
    results = {name: parts[name]() for name in options.parts or parts}
    for name, rows in results.items():
        Console().print(table(name, rows))
    if options.json is not None:
        options.json.write_text(json.dumps(results, indent=1), encoding='utf-8')
    return 0


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
            'topic': f'~/{name}', 'build [ms]': milliseconds(build),
            'publish [ms]': milliseconds(lambda p=publisher, m=message: p.publish(m))})
    node.destroy_node()
    rclpy.shutdown()
    return rows


def measure_inputs(frame: RgbdFrame) -> Rows:
    """Return the time to pair and to decode one pair of images."""
    color, depth, info = as_messages(frame, frame.stamp_ns)
    pairer: FramePairer[Any] = FramePairer(30_000_000)
    stamps = iter(range(0, 10**12, 33_333_333))

    def pair() -> None:
        stamp = next(stamps)
        pairer.add_color(stamp, color, stamp)
        pairer.add_depth(stamp, depth, stamp)

    return [
        {'step': 'pair', 'time [ms]': milliseconds(pair)},
        {'step': 'decode rgb8 and 16UC1',
         'time [ms]': milliseconds(lambda: frame_from_messages(color, depth, info))},
    ]


def measure_latency(scene: SyntheticScene, seconds: float) -> Rows:
    """Return rate and latency of meshes while a camera publishes at 30 Hz."""
    from visualization_msgs.msg import Marker

    sent_s: dict[int, float] = {}
    latency_s: list[float] = []

    def on_mesh(data: bytes) -> None:
        stamp = deserialize_message(data, Marker).header.stamp
        key = stamp.sec * 1_000_000_000 + stamp.nanosec
        if key in sent_s:
            latency_s.append(time.monotonic() - sent_s[key])

    with tempfile.TemporaryDirectory() as folder:
        stamps = write_keypoints(scene, Path(folder), seconds)
        process = NodeProcess(SourceArguments('json', Path(folder)), 0.01)
        rclpy.init()
        node = rclpy.create_node('benchmark')
        node.create_subscription(Marker, '/pop/mesh', on_mesh, output_qos(), raw=True)
        try:
            publish_at_rate(node, scene.frame, stamps, sent_s)
        finally:
            node.destroy_node()
            rclpy.shutdown()
            process.stop()
    p50, p95 = np.percentile(latency_s, [50, 95]) if latency_s else (np.nan, np.nan)
    return [{'people': len(scene.people), 'frames sent': len(sent_s), 'meshes': len(latency_s),
             'rate [Hz]': round(len(latency_s) / seconds, 2),
             'p50 [ms]': round(1e3 * p50), 'p95 [ms]': round(1e3 * p95)}]


def publish_at_rate(
    node: Any, frame: RgbdFrame, stamps: list[int], sent_s: dict[int, float]
) -> None:
    """Publish the frame once per stamp at 30 Hz, after the node has subscribed."""
    from sensor_msgs.msg import CameraInfo, Image

    kinds = {COLOR: Image, DEPTH: Image, INFO: CameraInfo}
    publishers = {role: node.create_publisher(kind, role, 5) for role, kind in kinds.items()}
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while min(p.get_subscription_count() for p in publishers.values()) == 0:
        executor.spin_once(timeout_sec=0.1)
    due_s = time.monotonic()
    for stamp in stamps:
        color, depth, info = as_messages(frame, stamp)
        while (left_s := due_s - time.monotonic()) > 0:
            executor.spin_once(timeout_sec=left_s)
        sent_s[stamp] = time.monotonic()
        publishers[INFO].publish(info)
        publishers[COLOR].publish(color)
        publishers[DEPTH].publish(depth)
        due_s += 1 / RATE_HZ
    executor.remove_node(node)


def write_keypoints(scene: SyntheticScene, folder: Path, seconds: float) -> list[int]:
    """Write the scene's keypoints for every stamp that will be published."""
    found = [d for d in scene.detections() if d is not None]
    count = round(seconds * RATE_HZ)
    stamps = [scene.frame.stamp_ns + round(k * 1e9 / RATE_HZ) for k in range(count)]
    for stamp in stamps:
        write_openpose_json(folder / f'{stamp}.json', found)
    return stamps


def as_messages(frame: RgbdFrame, stamp_ns: int) -> tuple[Any, Any, Any]:
    """Return a frame as a camera publishes it."""
    header = make_header(stamp_ns, FRAME_ID)
    return (color_message(frame.rgb, header), depth_message(frame.depth_m, header),
            info_message(frame.camera, header))


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
        made.add_column(key)
    for row in rows:
        made.add_row(*(str(value) for value in row.values()))
    return made
