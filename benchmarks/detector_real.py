"""Real frames to look for people in: folders of images, and frames of recordings."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pop_core.errors import PopError
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_reader import BagMessage, BagReader
from pop_ros.bag_topics import find_topics
from pop_ros.frame_folder import load_frame
from pop_ros.from_messages import frame_from_messages
from pop_ros.pairing import FramePairer
from pop_ros.replay import paired_frames

REAL = Path(__file__).resolve().parents[2] / 'shared' / 'data'
SLOP_NS = 500_000_000  # the stamps of these recordings lie up to a third of a second apart


def real_frames(folder: Path) -> Iterator[tuple[str, RgbdFrame, str]]:
    """Yield name, frame and who is there of every real frame below a folder."""
    rgbd = folder / 'rgbd'
    for name, there in (('five_people', '5 there'), ('office_empty', 'nobody there')):
        if (rgbd / name).is_dir():
            yield name, load_frame(rgbd / name), there
    for path in sorted((rgbd / 'sofa_pointing').glob('[0-9]*')):
        yield f'sofa_{path.name}', load_frame(path), '1 there'
    for path in sorted((folder / 'bags').glob('*.bag')):
        for number, frame in enumerate(_bag_frames(path)):
            yield f'{path.stem}_{number}', frame, 'a standing man, others behind'


def _bag_frames(path: Path) -> Iterator[RgbdFrame]:
    with BagReader(path) as bag:
        topics = find_topics(bag)
        pairer: FramePairer[BagMessage] = FramePairer(SLOP_NS)
        for pair in paired_frames(bag, topics, pairer, lambda: None):
            try:
                yield frame_from_messages(pair.color.read(), pair.depth.read(), pair.info.read())
            except PopError as error:
                print(f'{path.name}: {error}')
