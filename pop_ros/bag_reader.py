"""Read bags of ROS 1 (.bag) and ROS 2 (.db3, .mcap, folders) alike, damaged ones in part.

Whatever the bag's version, messages come out as ROS 2 CDR, so that they can be published as they
are and read with one set of types.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

from rosbags.highlevel import AnyReader

from pop_core.errors import PopError
from pop_ros.bag_salvage import is_ros1_bag, salvage
from pop_ros.ros1_conversion import STORE, ros1_to_cdr

SUFFIXES = ('.bag', '.db3', '.mcap')


class BagError(PopError):
    """A bag that does not exist, is no bag, or lacks the topics that are needed."""


@dataclass(frozen=True, slots=True)
class BagTopic:
    """One topic of a bag.

    Args:
        name: Topic.
        kind: Type in the form 'sensor_msgs/msg/Image'.
        count: Messages.
    """

    name: str
    kind: str
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class BagMessage:
    """One message of a bag.

    Args:
        topic: Topic.
        kind: Type in the form 'sensor_msgs/msg/Image'.
        time_ns: Time of recording [ns].
        data: The message as little-endian ROS 2 CDR.
    """

    topic: str
    kind: str
    time_ns: int
    data: bytes

    def read(self) -> Any:
        """Return the message as an object with the fields of ROS 2."""
        return STORE.deserialize_cdr(self.data, self.kind)


class BagReader:
    """An open bag."""

    def __init__(self, path: Path) -> None:
        """Name a bag: a file, or the folder of a rosbag2.

        Raises:
            BagError: If there is none.
        """
        self.path = path
        self.files = _files(path)
        self._damage = ''
        self.topics: list[BagTopic] = []
        self._reader: AnyReader | None = None

    def __enter__(self) -> BagReader:
        """Open the bag.

        Raises:
            BagError: If nothing in it can be read.
        """
        try:
            if self.path.suffix == '.active':
                raise BagError('its recorder never finished it')
            reader = AnyReader(self.files, default_typestore=STORE)
            reader.open()
        except Exception as error:  # noqa: BLE001 - rosbags passes on what its storages raise
            self._damage = f'{error}'.rstrip('.') or type(error).__name__
            self.topics = self._salvaged_topics()
        else:
            self._reader = reader
            counts = Counter[tuple[str, str]]()
            for c in reader.connections:
                counts[c.topic, c.msgtype] += c.msgcount
            self.topics = [BagTopic(*key, count) for key, count in sorted(counts.items())]
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the bag."""
        if self._reader is not None:
            self._reader.close()
            self._reader = None

    @property
    def name(self) -> str:
        """Return its path."""
        return str(self.path)

    @property
    def damage(self) -> str:
        """Return what was wrong with it, as far as it has been read."""
        return self._damage

    def messages(
        self, topics: Collection[str], start_ns: int | None = None, stop_ns: int | None = None
    ) -> Iterator[BagMessage]:
        """Yield the messages of some topics in order of time, up to the damage if there is any.

        Args:
            topics: Their names.
            start_ns: Earliest time of recording [ns], or None for all.
            stop_ns: Time of recording before which it ends [ns], or None for all.
        """
        if self._reader is None:
            yield from _within(self._salvaged(topics), start_ns, stop_ns)
            return
        connections = [c for c in self._reader.connections if c.topic in topics]
        if not connections:  # rosbags would take none for all
            return
        try:
            for connection, time_ns, raw in self._reader.messages(
                    connections, start=start_ns, stop=stop_ns):
                data = _as_cdr(raw, connection.msgtype, is_ros2=self._reader.is2)
                yield BagMessage(connection.topic, connection.msgtype, time_ns, data)
        except Exception as error:  # noqa: BLE001 - rosbags passes on what its storages raise
            self._damage = f'{error}'.rstrip('.') or type(error).__name__

    def first(self, topic: str) -> BagMessage | None:
        """Return the first message of a topic."""
        return next(iter(self.messages([topic])), None)

    def span_ns(self) -> tuple[int, int] | None:
        """Return the times of the first and the last message [ns], None without any."""
        if self._reader is not None:
            empty = not self._reader.message_count
            # rosbags ends a bag one nanosecond after its last message.
            return None if empty else (self._reader.start_time, self._reader.end_time - 1)
        times = [m.time_ns for path in self._storage_files() for m in salvage(path)]
        return (min(times), max(times)) if times else None

    def _storage_files(self) -> list[Path]:
        return _storages(self.path) if self.path.is_dir() else [self.path]

    def _salvaged_topics(self) -> list[BagTopic]:
        counts: Counter[tuple[str, str]] = Counter()
        for path in self._storage_files():
            counts.update((m.topic, m.kind) for m in salvage(path))
        if not counts:
            raise BagError(
                f'{self.path}: expected a bag ({", ".join(SUFFIXES)} or a rosbag2 folder), found '
                f'no message that can be read ({self._damage})')
        return [BagTopic(*key, count) for key, count in sorted(counts.items())]

    def _salvaged(self, topics: Collection[str]) -> Iterator[BagMessage]:
        for path in self._storage_files():
            for m in salvage(path):
                if m.topic not in topics:
                    continue
                try:
                    data = _as_cdr(m.data, m.kind, is_ros2=not is_ros1_bag(path))
                except Exception:  # noqa: BLE001 - rosbags passes on what struct and numpy raise
                    break  # whatever follows the damage cannot be trusted
                yield BagMessage(m.topic, m.kind, m.time_ns, data)


def _as_cdr(raw: bytes | memoryview, kind: str, *, is_ros2: bool) -> bytes:
    return bytes(raw) if is_ros2 else ros1_to_cdr(bytes(raw), kind)


def _within(
    messages: Iterator[BagMessage], start_ns: int | None, stop_ns: int | None
) -> Iterator[BagMessage]:
    for message in messages:
        late = start_ns is None or message.time_ns >= start_ns
        if late and (stop_ns is None or message.time_ns < stop_ns):
            yield message


def _files(path: Path) -> list[Path]:
    if not path.exists():
        raise BagError(f'{path}: expected a bag, found nothing there')
    # rosbags takes any path that ends in .bag for a ROS 1 file; a folder of that name is ours.
    named_like_ros1 = path.is_dir() and path.suffix == '.bag'
    if path.is_file() or ((path / 'metadata.yaml').is_file() and not named_like_ros1):
        return [path]
    found = _storages(path)
    if not found:
        raise BagError(
            f'{path}: expected a rosbag2 folder, found no {" or ".join(SUFFIXES)} in it')
    return found


def _storages(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.suffix in SUFFIXES)
