"""A camera at 30 Hz for the benchmarks of the node: a film of people who move, to and fro."""

from __future__ import annotations

import itertools
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, Image

from pop_core.body.default_body import default_body
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.synthesis.sequence_names import SequenceKind
from pop_ros.image_messages import color_message, depth_message, info_message
from pop_ros.inputs import COLOR, DEPTH, INFO
from pop_ros.to_messages import make_header

RATE_HZ = 30.0
FRAME_ID = 'camera_color_optical_frame'
FILM_FRAMES = 60
KINDS = {1: SequenceKind.TABLE, 2: SequenceKind.CROSSING, 3: SequenceKind.THREE}
TYPES = {INFO: CameraInfo, COLOR: Image, DEPTH: Image}
KEPT_FILES = 300  # ten seconds: no frame in work is older


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One frame of the film: serialised messages by role, and the file of its keypoints."""

    messages: dict[str, bytes]
    keypoints: Path


class Film:
    """Frames of some people, played forward and backward for as long as wanted."""

    def __init__(self, people: int, folder: Path) -> None:
        """Synthesise the film; keypoint files go into `folder`."""
        self.folder = folder / 'keypoints'
        self.folder.mkdir()
        config = SequenceConfig(KINDS[people], FILM_FRAMES, RATE_HZ)
        self._pictures = []
        for k, frame in enumerate(film_sequence(default_body(), 4, config)):
            path = folder / f'{k}.json'
            write_openpose_json(path, [d for d in frame.detections if d is not None])
            self._pictures.append(Picture(_serialised(frame.scene.frame), path))

    def play(self, start_ns: int) -> Iterator[tuple[int, dict[str, bytes]]]:
        """Yield stamps [ns] and messages for ever; keypoints of each stamp are written before."""
        to_and_fro = [*self._pictures, *self._pictures[-2:0:-1]]
        written: list[Path] = []
        for k, picture in enumerate(itertools.cycle(to_and_fro)):
            stamp = start_ns + round(k * 1e9 / RATE_HZ)
            name = self.folder / f'{stamp}.json'
            name.hardlink_to(picture.keypoints)
            written.append(name)
            if len(written) > KEPT_FILES:
                written.pop(0).unlink()
            yield stamp, {role: with_stamp(data, stamp) for role, data in picture.messages.items()}


class Camera:
    """Publishes a film at 30 Hz and lets the node's executor work in between."""

    def __init__(self, node: Node, film: Film) -> None:
        """Advertise the topics."""
        self.sent_s: dict[int, float] = {}
        self._publishers = {role: node.create_publisher(kind, role, 5)
                            for role, kind in TYPES.items()}
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._frames = film.play(time.time_ns())
        self._due_s = 0.0

    def wait_for_subscriber(self, check: Callable[[], None]) -> None:
        """Wait until the node is ready."""
        while min(p.get_subscription_count() for p in self._publishers.values()) == 0:
            check()
            self._executor.spin_once(timeout_sec=0.1)
        self._due_s = time.monotonic()

    def run(self, seconds: float) -> None:
        """Publish for some seconds."""
        end_s = self._due_s + seconds
        while self._due_s < end_s:
            while (left_s := self._due_s - time.monotonic()) > 0:
                self._executor.spin_once(timeout_sec=left_s)
            stamp, messages = next(self._frames)
            self.sent_s[stamp] = time.monotonic()
            for role, data in messages.items():
                self._publishers[role].publish(data)
            self._due_s += 1 / RATE_HZ


def as_messages(frame: RgbdFrame) -> dict[str, Any]:
    """Return a frame by role, as a camera publishes it."""
    header = make_header(frame.stamp_ns, FRAME_ID)
    return {INFO: info_message(frame.camera, header), COLOR: color_message(frame.rgb, header),
            DEPTH: depth_message(frame.depth_m, header)}


def with_stamp(data: bytes, stamp_ns: int) -> bytes:
    """Return a serialised message that starts with a header, with another stamp [ns]."""
    return data[:4] + struct.pack('<iI', *divmod(stamp_ns, 1_000_000_000)) + data[12:]


def _serialised(frame: RgbdFrame) -> dict[str, bytes]:
    return {role: bytes(serialize_message(m)) for role, m in as_messages(frame).items()}
