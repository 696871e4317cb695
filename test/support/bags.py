"""Write RGB-D bags of every kind that `pop replay` reads."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore
from support.messages import IMAGE, INFO, STORE

COLOR, CAMERA = '/cam/color/image_raw', '/cam/color/camera_info'
DEPTH = '/cam/aligned_depth/image_raw'
ROS1_STORE = get_typestore(Stores.ROS1_NOETIC)

# Topic, type, time [ns], message as rosbags' ROS 2 object.
Entry = tuple[str, str, int, Any]


def rgbd_entries(frames: Iterable[tuple[int, Any, Any, Any]]) -> list[Entry]:
    """Return entries of (stamp, colour, depth, camera info) frames, as a camera sends them."""
    entries = []
    for stamp_ns, color, depth, info in frames:
        entries += [
            (CAMERA, INFO, stamp_ns, info), (COLOR, IMAGE, stamp_ns + 1, color),
            (DEPTH, IMAGE, stamp_ns + 2, depth)]
    return entries


def write_bag(path: Path, entries: Iterable[Entry]) -> Path:
    """Write a .bag, .db3 or .mcap (the latter two as rosbag2 folders named without suffix)."""
    if path.suffix == '.bag':
        return _write_ros1(path, entries)
    plugin = {'.db3': StoragePlugin.SQLITE3, '.mcap': StoragePlugin.MCAP}[path.suffix]
    folder = path.with_suffix('')
    with Ros2Writer(folder, version=9, storage_plugin=plugin) as bag:
        topics: dict[str, Any] = {}
        for topic, kind, time_ns, message in entries:
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, kind, typestore=STORE)
            bag.write(topics[topic], time_ns, STORE.serialize_cdr(message, kind))
    return folder


def _write_ros1(path: Path, entries: Iterable[Entry]) -> Path:
    with Ros1Writer(path) as bag:
        topics: dict[str, Any] = {}
        for topic, kind, time_ns, message in entries:
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, kind, typestore=ROS1_STORE)
            cdr = STORE.serialize_cdr(message, kind, little_endian=True)
            bag.write(topics[topic], time_ns, bytes(STORE.cdr_to_ros1(cdr, kind)))
    return path
