"""A camera, the node, a listener: latency, rate, processor and memory, for minutes if wanted."""

from __future__ import annotations

import struct
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import rclpy
from rclpy.node import Node
from visualization_msgs.msg import Marker

from benchmarks.node_camera import Camera, Film
from benchmarks.node_process import WatchedNode
from pop_ros.qos import output_qos

Row = dict[str, object]
WARM_UP_S = 5.0
SOAK_WARM_UP_S = 60.0
WINDOW_S = 15.0
MOST_MEMORY_MB, MOST_GROWTH_MB = 1000.0, 20.0
SLOWER = 1.25  # a last third beyond this times the first one is a latency that grows
LONGEST_STOP_S = 10.0


@dataclass(slots=True)
class Listener:
    """Receives meshes and knows when their images were sent."""

    sent_s: dict[int, float] = field(default_factory=dict)
    first_s: float | None = None
    latency_s: list[float] = field(default_factory=list)
    stamps: set[int] = field(default_factory=set)

    def on_mesh(self, data: bytes) -> None:
        """Take note of a serialised Marker; only its stamp is read."""
        now = time.monotonic()
        self.first_s = self.first_s or now
        sec, nanosec = struct.unpack_from('<iI', data, 4)
        stamp = sec * 1_000_000_000 + nanosec
        if stamp in self.sent_s:
            self.latency_s.append(now - self.sent_s[stamp])
            self.stamps.add(stamp)

    def take(self) -> tuple[list[float], int]:
        """Return latencies [s] and the number of images answered since the last call."""
        taken = self.latency_s, len(self.stamps)
        self.latency_s, self.stamps = [], set()
        return taken


@dataclass(frozen=True, slots=True, eq=False)
class Live:
    """What runs during a measurement."""

    process: WatchedNode
    camera: Camera
    listener: Listener

    def measure(self, seconds: float) -> Row:
        """Return what happened in some seconds."""
        self.listener.take()
        cpu_s, started_s, sent = self.process.cpu_s, time.monotonic(), len(self.camera.sent_s)
        self.camera.run(seconds)
        wall_s = time.monotonic() - started_s
        latency_s, frames = self.listener.take()
        p50, p95 = np.percentile(latency_s, [50, 95]) * 1e3 if latency_s else (np.nan, np.nan)
        return {
            'rate [Hz]': round(frames / wall_s, 1),
            'answered [%]': round(100 * frames / max(len(self.camera.sent_s) - sent, 1)),
            'p50 [ms]': round(float(p50)),
            'p95 [ms]': round(float(p95)),
            'CPU [%]': round(100 * (self.process.cpu_s - cpu_s) / wall_s),
            'memory [MB]': round(self.process.memory_mb)}


@contextmanager
def live(people: int, source: str = 'json', *ros_arguments: str) -> Iterator[Live]:
    """Start everything and wait for the first mesh; keypoints are the film's, or a network's."""
    with tempfile.TemporaryDirectory() as folder:
        film = Film(people, Path(folder))
        process = WatchedNode(source, film.folder, *ros_arguments)
        rclpy.init()
        node = Node('benchmark')
        try:
            camera = Camera(node, film)
            listener = Listener(camera.sent_s)
            node.create_subscription(
                Marker, '/pop/mesh', listener.on_mesh, output_qos(), raw=True)
            camera.wait_for_subscriber(process.check)
            while listener.first_s is None:
                process.check()
                camera.run(0.2)
            yield Live(process, camera, listener)
        finally:
            node.destroy_node()
            rclpy.shutdown()
            process.stop()


def measure_latency(people: int, seconds: float, source: str) -> Row:
    """Return time to the first result, rate, latency, processor and memory, for a source."""
    with live(people, source) as running:
        first_s = running.listener.first_s
        assert first_s is not None
        running.camera.run(WARM_UP_S)
        return {'people': people,
                'first result [s]': round(first_s - running.process.started_s, 1),
                **running.measure(seconds)}


def soak(
    people: int, minutes: float, source: str, show: Callable[[Row], None]
) -> tuple[Row, bool]:
    """Run for minutes, showing a row now and then; return the verdict, and whether it is good."""
    rows: list[Row] = []
    with live(people, source) as running:
        running.camera.run(min(SOAK_WARM_UP_S, 6 * minutes))
        end_s = time.monotonic() + 60 * minutes
        while time.monotonic() < end_s:
            left_s = end_s - time.monotonic()
            rows.append(running.measure(min(WINDOW_S, max(left_s, 1.0))))
            show({'minute': round(minutes - max(end_s - time.monotonic(), 0) / 60, 1), **rows[-1]})
        code, stop_s = running.process.stop()
    return verdict(rows, code, stop_s)


def verdict(rows: list[Row], code: int, stop_s: float) -> tuple[Row, bool]:
    """Compare the end of a long run with its beginning.

    Args:
        rows: What `Live.measure` said, in order.
        code: Exit code of the node.
        stop_s: How long it took to end [s].
    """
    memory_mb = np.array([row['memory [MB]'] for row in rows], dtype=np.float64)
    p95_ms = np.array([row['p95 [ms]'] for row in rows], dtype=np.float64)
    third = max(len(rows) // 3, 1)
    before_ms, after_ms = np.median(p95_ms[:third]), np.median(p95_ms[-third:])
    growth_mb = float(np.median(memory_mb[-third:]) - np.median(memory_mb[:third]))
    good = {
        'memory': memory_mb.max() <= MOST_MEMORY_MB and growth_mb <= MOST_GROWTH_MB,
        'latency': bool(after_ms <= SLOWER * before_ms),
        'end': code == 0 and stop_s <= LONGEST_STOP_S,
    }
    row: Row = {
        'most memory [MB]': round(float(memory_mb.max())), 'growth [MB]': round(growth_mb, 1),
        'p95 first third [ms]': round(float(before_ms)),
        'p95 last third [ms]': round(float(after_ms)),
        'exit code': code, 'end [s]': round(stop_s, 1),
        'verdict': 'good' if all(good.values()) else
                   f'bad: {", ".join(name for name, is_good in good.items() if not is_good)}'}
    return row, all(good.values())
