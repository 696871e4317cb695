"""Write results into a new rosbag2 and, beside it, into a ROS 1 bag."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer

from pop_ros.bag_reader import BagError
from pop_ros.ros1_conversion import ROS1_STORE, STORE, cdr_to_ros1

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
# The players of both ROS versions give what is latched to whoever comes later, too.
LATCHED = Qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL,
    QosTime(0, 0), QosTime(0, 0), QosLiveliness.AUTOMATIC, QosTime(0, 0), False)


class BagWriter:
    """A new rosbag2 folder, and a ROS 1 bag where asked for."""

    def __init__(
        self, folder: Path, ros1_file: Path | None = None, storage: str = 'mcap'
    ) -> None:
        """Prepare the bags.

        Args:
            folder: New rosbag2 folder.
            ros1_file: New ROS 1 bag, or None.
            storage: 'mcap' or 'sqlite3'.

        Raises:
            BagError: If one of them exists (recordings are never overwritten), or there is no
                such storage.
        """
        if storage not in STORAGES:
            raise BagError(f'storage: expected {" or ".join(STORAGES)}, found {storage!r}')
        for path in filter(None, (folder, ros1_file)):
            if path.exists():
                raise BagError(f'{path}: expected a new bag to write, found one there already')
        self.counts: dict[str, int] = {}
        # Version 9 is that of Jazzy.
        self._ros2 = Ros2Writer(folder, version=9, storage_plugin=STORAGES[storage])
        self._ros1 = Ros1Writer(ros1_file) if ros1_file is not None else None
        self._connections: dict[str, tuple[Any, Any]] = {}

    def __enter__(self) -> BagWriter:
        """Create the bags."""
        self._ros2.open()
        if self._ros1 is not None:
            self._ros1.open()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Finish the bags."""
        self._ros2.close()
        if self._ros1 is not None:
            self._ros1.close()

    def add_topic(self, topic: str, kind: str, *, latched: bool = False) -> None:
        """Announce a topic, so that it is in the bag even when nothing is written to it."""
        if topic in self._connections:
            return
        ros1 = None
        if self._ros1 is not None:
            ros1 = self._ros1.add_connection(
                topic, kind, typestore=ROS1_STORE, latching=int(latched))
        ros2 = self._ros2.add_connection(
            topic, kind, typestore=STORE, offered_qos_profiles=[LATCHED] if latched else [])
        self._connections[topic] = (ros2, ros1)

    def write(self, topic: str, kind: str, time_ns: int, data: bytes) -> None:
        """Write a message, given as ROS 2 CDR, at a time [ns]."""
        self.add_topic(topic, kind)
        ros2, ros1 = self._connections[topic]
        self._ros2.write(ros2, time_ns, data)
        if self._ros1 is not None:
            self._ros1.write(ros1, time_ns, cdr_to_ros1(data, kind))
        self.counts[topic] = self.counts.get(topic, 0) + 1
