"""Read what is left of a bag whose recorder died: no index, cut in the middle of a record.

ROS 1 bags and MCAP are sequences of records that can be walked from the start. ROS 1 (format 2.0):
header fields and data, each with a length. MCAP: opcode, length, content. SQLite gives the rows
of a table up to the first page that is missing or wrong.
"""

from __future__ import annotations

import bz2
import sqlite3
import struct
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO
from urllib.parse import quote

import lz4.frame  # type: ignore[import-untyped]

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

MCAP_MAGIC = b'\x89MCAP0\r\n'
ROS1_MAGIC = b'#ROSBAG V2.0\n'
ROS1_MESSAGE, ROS1_CHUNK, ROS1_CONNECTION = 2, 5, 7
MCAP_SCHEMA, MCAP_CHANNEL, MCAP_MESSAGE, MCAP_CHUNK = 3, 4, 5, 6


@dataclass(frozen=True, slots=True, eq=False)
class SalvagedMessage:
    """One message as it was stored.

    Args:
        topic: Topic.
        kind: Type in the form 'sensor_msgs/msg/Image'.
        time_ns: Time of recording [ns].
        data: Serialised as in the bag's own ROS version.
    """

    topic: str
    kind: str
    time_ns: int
    data: bytes


class _CutOffError(Exception):
    """The file ends inside a record."""


def is_ros1_bag(path: Path) -> bool:
    """Return whether a name is that of a ROS 1 bag; a recorder that died leaves `.bag.active`."""
    return '.bag' in path.suffixes


def salvage(path: Path) -> Iterator[SalvagedMessage]:
    """Yield the whole messages of a damaged .bag, .mcap or .db3 file up to the damage."""
    if path.suffix == '.db3':
        yield from _walk_sqlite(path)
        return
    with path.open('rb') as file:
        if is_ros1_bag(path):
            if file.read(len(ROS1_MAGIC)) == ROS1_MAGIC:
                yield from _walk_ros1(file, {})
        elif file.read(len(MCAP_MAGIC)) == MCAP_MAGIC:
            yield from _walk_mcap(file, {}, {})


def _walk_ros1(
    file: BinaryIO, topics: dict[int, tuple[str, str]]
) -> Iterator[SalvagedMessage]:
    try:
        while True:
            fields = dict(_ros1_fields(_sized(file, '<I')))
            data, is_whole = _sized_or_rest(file, '<I')
            op = fields[b'op'][0]
            if op == ROS1_CHUNK and (is_whole or fields[b'compression'] == b'none'):
                inner = _decompress(fields[b'compression'].decode(), data)
                yield from _walk_ros1(BytesIO(inner), topics)
            elif not is_whole:
                return
            elif op == ROS1_CONNECTION:
                package, name = dict(_ros1_fields(data))[b'type'].decode().split('/')
                number, = struct.unpack('<I', fields[b'conn'])
                topics[number] = (fields[b'topic'].decode(), f'{package}/msg/{name}')
            elif op == ROS1_MESSAGE:
                number, = struct.unpack('<I', fields[b'conn'])
                sec, nanosec = struct.unpack('<II', fields[b'time'])
                topic, kind = topics[number]
                yield SalvagedMessage(topic, kind, sec * 1_000_000_000 + nanosec, data)
    except (_CutOffError, KeyError, ValueError, RuntimeError, OSError, zstd.ZstdError):
        return  # whatever follows the damage cannot be trusted


def _walk_mcap(
    file: BinaryIO, topics: dict[int, tuple[str, str]], schemas: dict[int, str]
) -> Iterator[SalvagedMessage]:
    try:
        while True:
            op = _exactly(file, 1)[0]
            data, is_whole = _sized_or_rest(file, '<Q')
            record = BytesIO(data)
            if op == MCAP_CHUNK:
                _exactly(record, 28)
                compression = _sized(record, '<I').decode()
                inner, _ = _sized_or_rest(record, '<Q')
                if is_whole or not compression:
                    yield from _walk_mcap(
                        BytesIO(_decompress(compression, inner)), topics, schemas)
            elif not is_whole:
                return
            elif op == MCAP_SCHEMA:
                number, = struct.unpack('<H', _exactly(record, 2))
                schemas[number] = _sized(record, '<I').decode()
            elif op == MCAP_CHANNEL:
                number, schema = struct.unpack('<HH', _exactly(record, 4))
                topics[number] = (_sized(record, '<I').decode(), schemas[schema])
            elif op == MCAP_MESSAGE:
                number, _, time_ns, _ = struct.unpack('<HIQQ', _exactly(record, 22))
                yield SalvagedMessage(*topics[number], time_ns, record.read())
    except (_CutOffError, KeyError, ValueError, RuntimeError, OSError, zstd.ZstdError):
        return  # whatever follows the damage cannot be trusted


def _walk_sqlite(path: Path) -> Iterator[SalvagedMessage]:
    query = ('SELECT topics.name, topics.type, messages.timestamp, messages.data FROM messages '
             'JOIN topics ON messages.topic_id = topics.id ORDER BY messages.id')
    try:
        with closing(sqlite3.connect(f'file:{quote(str(path))}?mode=ro', uri=True)) as database:
            # SQLite then opens a file that is shorter than its first page says, too.
            database.execute('PRAGMA writable_schema = ON')
            for row in database.execute(query):
                yield SalvagedMessage(*row)
    except sqlite3.Error:
        return  # whatever follows the damage cannot be trusted


def _ros1_fields(header: bytes) -> Iterator[tuple[bytes, bytes]]:
    file = BytesIO(header)
    while file.tell() < len(header):
        name, _, value = _sized(file, '<I').partition(b'=')
        yield name, value


def _exactly(file: BinaryIO, size: int) -> bytes:
    data = file.read(size)
    if len(data) < size:
        raise _CutOffError
    return data


def _sized(file: BinaryIO, length_format: str) -> bytes:
    size, = struct.unpack(length_format, _exactly(file, struct.calcsize(length_format)))
    return _exactly(file, size)


def _sized_or_rest(file: BinaryIO, length_format: str) -> tuple[bytes, bool]:
    """Return a record's data, or what there is of it, and whether it is whole."""
    size, = struct.unpack(length_format, _exactly(file, struct.calcsize(length_format)))
    data = file.read(size)
    return data, len(data) == size


def _decompress(compression: str, data: bytes) -> bytes:
    if compression in {'', 'none'}:
        return data
    if compression == 'bz2':
        return bz2.decompress(data)
    if compression == 'lz4':
        return bytes(lz4.frame.decompress(data))
    if compression == 'zstd':
        return zstd.decompress(data)
    raise ValueError(compression)
