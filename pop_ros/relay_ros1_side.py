"""The ROS 1 half of `pop relay-ros1`: a program of its own for the Python that has rospy.

It reads one line of JSON, [[topic, type, md5, definition], ...], then records of topic number,
size and a message as ROS 1 serialises it, and publishes them. The end of the input ends it. It
must not import anything of this package: Debian's Python knows nothing of it. Nor does it need
packages of messages, whose definitions it is told.
"""

from __future__ import annotations

import json
import struct
import sys
from typing import Any, BinaryIO

READY = b'ready\n'
RECORD = '<II'
NO_ROSPY = 3


def main() -> None:
    """Publish what comes in until it ends."""
    try:
        import genpy
        import rospy
    except ImportError:
        sys.exit(NO_ROSPY)
    topics = json.loads(sys.stdin.buffer.readline())
    rospy.init_node('pop_relay', anonymous=True, disable_signals=True)
    kinds = [_message_type(genpy.Message, *definition) for _, *definition in topics]
    publishers = [
        rospy.Publisher(topic[0], kind, queue_size=10)
        for topic, kind in zip(topics, kinds)]  # noqa: B905 - also for Python 3.9
    sys.stdout.buffer.write(READY)
    sys.stdout.buffer.flush()
    while True:
        record = _exactly(sys.stdin.buffer, struct.calcsize(RECORD))
        if record is None:
            break
        number, size = struct.unpack(RECORD, record)
        data = _exactly(sys.stdin.buffer, size)
        if data is None:
            break
        message = kinds[number](content=data)
        publishers[number].publish(message)
    rospy.signal_shutdown('the ROS 2 side ended')


def _message_type(base: Any, name: str, md5: str, definition: str) -> Any:
    """Return a message type whose messages are serialised already."""
    class Serialised(base):  # type: ignore[misc]
        _type, _md5sum, _full_text = name, md5, definition
        _has_header = False  # rospy would number it; ours is inside
        __slots__ = ('content',)
        _slot_types = ('string',)

        def serialize(self, buff: Any) -> None:
            buff.write(self.content)

    return Serialised


def _exactly(stream: BinaryIO, size: int) -> bytes | None:
    data = stream.read(size)
    return data if len(data) == size else None


if __name__ == '__main__':
    main()
