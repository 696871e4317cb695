"""Copy what a replay reads of a recording into the bag of its results."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from pop_ros.bag_merge import STATIC_TF
from pop_ros.bag_reader import BagMessage, BagTopic
from pop_ros.bag_writer import BagWriter
from pop_ros.recording import Recording

TRANSFORMS = 'tf2_msgs/msg/TFMessage'


class CopiedInputs:
    """A recording whose messages are written into another bag as they are read.

    With them go the transforms, so that the results can be looked at in every frame.
    """

    def __init__(self, bag: Recording, cameras: Collection[str], writer: BagWriter) -> None:
        """Announce what will be copied.

        Args:
            bag: Open recording.
            cameras: Topics of the camera.
            writer: Open bag to write.
        """
        self._bag, self._writer = bag, writer
        self.topics: list[BagTopic] = bag.topics
        copied = [t for t in bag.topics if t.name in cameras or t.kind == TRANSFORMS]
        self._copied = {topic.name for topic in copied}
        for topic in copied:
            writer.add_topic(topic.name, topic.kind, latched=topic.name == STATIC_TF)

    @property
    def name(self) -> str:
        """Return where the recording lies."""
        return self._bag.name

    @property
    def damage(self) -> str:
        """Return what was wrong with the recording."""
        return self._bag.damage

    def first(self, topic: str) -> BagMessage | None:
        """Return the first message of a topic."""
        return self._bag.first(topic)

    def messages(self, topics: Collection[str]) -> Iterator[BagMessage]:
        """Yield the messages of some topics in order of time; copy these and the transforms."""
        for message in self._bag.messages({*topics, *self._copied}):
            if message.topic in self._copied:
                self._writer.write(message.topic, message.kind, message.time_ns, message.data)
            if message.topic in topics:
                yield message
