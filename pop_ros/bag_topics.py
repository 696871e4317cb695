"""Find the colour, depth and CameraInfo topics of a bag by type, encoding and name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from pop_ros.bag_reader import BagError, BagTopic
from pop_ros.compressed import CompressedLike, is_compressed, is_compressed_depth
from pop_ros.from_messages import COLOR_CHANNELS, DEPTH_TYPES
from pop_ros.recording import Recording

IMAGE, INFO = 'sensor_msgs/msg/Image', 'sensor_msgs/msg/CameraInfo'
COMPRESSED = 'sensor_msgs/msg/CompressedImage'
REGISTERED = ('registered', 'aligned', 'depth_to_rgb', 'depth_to_color')
COLOR_WORDS = ('color', 'colour', 'rgb')
INFRARED_WORDS = ('infra', '/ir/', '/ir_')


@dataclass(frozen=True, slots=True)
class RgbdTopics:
    """The topics of one RGB-D camera.

    Args:
        color: Colour image.
        depth: Depth image registered to it.
        info: CameraInfo of the colour camera.
    """

    color: str
    depth: str
    info: str

    @property
    def all(self) -> tuple[str, str, str]:
        """Return the three names."""
        return self.color, self.depth, self.info


@dataclass(frozen=True, slots=True)
class ImageTopic:
    """An image topic and the encoding of its first message.

    Args:
        name: Topic.
        encoding: As in the message; of compressed images that of the image inside.
        is_raw: Whether the image is not compressed.
    """

    name: str
    encoding: str
    is_raw: bool = True


def find_topics(
    bag: Recording, color: str | None = None, depth: str | None = None, info: str | None = None
) -> RgbdTopics:
    """Return the RGB-D topics of a bag; named ones are taken as they are.

    Raises:
        BagError: If a named topic is not there, or one cannot be found.
    """
    known = {topic.name: topic for topic in bag.topics}
    for name in filter(None, (color, depth, info)):
        if name not in known:
            raise BagError(f'{bag.name}: expected topic {name}, found {_listing(bag.topics)}')
    images = list(_image_topics(bag))
    infos = [topic.name for topic in bag.topics if topic.kind == INFO]
    found_color = color or choose_color(images, infos)
    found_depth = depth or choose_depth(images)
    found_info = info or (found_color and choose_info(found_color, infos))
    if not (found_color and found_depth and found_info):
        roles = {'color image': found_color, 'depth image': found_depth, 'camera_info': found_info}
        missing = ' and '.join(name for name, topic in roles.items() if not topic)
        raise BagError(
            f'{bag.name}: expected an RGB-D camera, found no {missing} in '
            f'{_listing(bag.topics)}; {_advice(bag)}')
    return RgbdTopics(found_color, found_depth, found_info)


def choose_color(images: Iterable[ImageTopic], infos: Sequence[str]) -> str | None:
    """Return the most likely colour topic: a colour encoding, named so, calibrated."""
    def score(topic: ImageTopic) -> tuple[bool, bool, bool, bool]:
        named = any(word in topic.name for word in COLOR_WORDS)
        calibrated = _sibling(topic.name) in infos
        return topic.encoding not in {'mono8', '8UC1'}, named, calibrated, topic.is_raw

    plain = [t for t in images if t.encoding in COLOR_CHANNELS
             and not any(word in t.name for word in INFRARED_WORDS)]
    return max(plain, key=score).name if plain else None


def choose_depth(images: Iterable[ImageTopic]) -> str | None:
    """Return the most likely depth topic: a depth encoding, registered to colour."""
    def score(topic: ImageTopic) -> tuple[bool, bool, bool]:
        registered = any(word in topic.name for word in REGISTERED)
        return registered, 'depth' in topic.name, topic.is_raw

    plain = [t for t in images if t.encoding in DEPTH_TYPES
             and not any(word in t.name for word in INFRARED_WORDS)]
    return max(plain, key=score).name if plain else None


def choose_info(color: str, infos: Sequence[str]) -> str | None:
    """Return the CameraInfo beside a colour topic, else the one that shares most of its path."""
    if _sibling(color) in infos:
        return _sibling(color)

    def shared(info: str) -> int:
        pairs = zip(PurePosixPath(color).parts, PurePosixPath(info).parts, strict=False)
        same = [a == b for a, b in pairs]
        return same.index(False) if False in same else len(same)

    fitting = [i for i in infos if 'depth' not in i and not any(w in i for w in INFRARED_WORDS)]
    return max(fitting or infos, key=shared, default=None)


def _image_topics(bag: Recording) -> Iterable[ImageTopic]:
    for topic in bag.topics:
        if topic.kind not in {IMAGE, COMPRESSED}:
            continue
        first = bag.first(topic.name)
        if first is not None:
            message = first.read()
            encoding = compressed_encoding(message) if is_compressed(message) else message.encoding
            yield ImageTopic(topic.name, str(encoding), topic.kind == IMAGE)


def compressed_encoding(message: CompressedLike) -> str:
    """Return the encoding of the image inside: 'rgb8; jpeg compressed bgr8' is 'rgb8'."""
    known, _, _ = message.format.partition(';')
    if is_compressed_depth(message):
        return known
    # Drivers that compress themselves say 'jpeg' and no more; depth is never JPEG.
    return known if known in {*COLOR_CHANNELS, *DEPTH_TYPES} else 'rgb8'


def _advice(bag: Recording) -> str:
    if bag.damage:
        return f'the bag is damaged ({bag.damage}), what was looked for may be behind the damage'
    return 'name topics with --color, --depth and --info'


def _sibling(color: str) -> str:
    folder = PurePosixPath(color.removesuffix('/compressed')).parent
    return str(folder / 'camera_info')


def _listing(topics: Sequence[BagTopic]) -> str:
    return ', '.join(f'{t.name} ({t.kind.split("/")[-1]}, {t.count})' for t in topics) or 'nothing'
