"""Several bags read like the one they are parts of, from a start for a duration."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.bags import CAMERA, COLOR, DEPTH, Entry, rgbd_entries, write_bag
from support.messages import IMAGE, INFO, TYPES, camera_info, depth_image, header, image

from pop_core.geometry.camera import Camera
from pop_ros.bag_merge import STATIC_TF, BagPart, MergedBags
from pop_ros.bag_reader import BagError, BagMessage
from pop_ros.bag_topics import find_topics
from pop_ros.from_messages import frame_from_messages
from pop_ros.pairing import FramePairer
from pop_ros.replay import paired_frames
from pop_ros.replay_inputs import TRANSFORMS

SUFFIXES = ('.bag', '.db3', '.mcap')
CAM = Camera(16, 12, 20.0, 20.0, 7.5, 5.5)
START_NS, STEP_NS = 1_700_000_000_000_000_000, 100_000_000
ALL = (COLOR, DEPTH, CAMERA)


def entries(count: int) -> list[Entry]:
    """Return frames ten times a second; the CameraInfo comes with the first only."""
    rng = np.random.default_rng(4)
    frames = []
    for stamp in range(START_NS, START_NS + count * STEP_NS, STEP_NS):
        rgb = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
        depth_m = rng.integers(500, 4000, (12, 16)).astype(np.float32) / 1000
        frames.append((stamp, image(rgb, 'rgb8', stamp), depth_image(depth_m, '16UC1', stamp),
                       camera_info(CAM, stamp)))
    made = rgbd_entries(frames)
    return [entry for n, entry in enumerate(made) if entry[0] != CAMERA or not n]


def transforms(child: str) -> object:
    vector, quaternion = (TYPES[f'geometry_msgs/msg/{name}'] for name in ('Vector3', 'Quaternion'))
    transform = TYPES['geometry_msgs/msg/Transform'](vector(0, 0, 1), quaternion(0, 0, 0, 1))
    stamped = TYPES['geometry_msgs/msg/TransformStamped'](header(START_NS), child, transform)
    return TYPES[TRANSFORMS]([stamped])


def read(*paths: Path, part: BagPart | None = None) -> list[tuple[str, int, bytes]]:
    with MergedBags(paths, part) as bags:
        return [(m.topic, m.time_ns, m.data) for m in bags.messages(ALL)]


@pytest.mark.parametrize('split', [
    lambda made: [made[:7], made[7:]],
    lambda made: [[e for e in made if e[0] == topic] for topic in ALL],
], ids=['by time', 'by topic'])
def test_parts_of_every_kind_read_like_the_whole(tmp_path: Path, split: object) -> None:
    whole = write_bag(tmp_path / 'whole.mcap', entries(5))
    parts = [write_bag(tmp_path / f'part{n}{suffix}', part)
             for n, (suffix, part) in enumerate(zip(SUFFIXES, split(entries(5)), strict=False))]
    # In whatever order they are named.
    assert read(*parts) == read(*parts[::-1]) == read(whole)
    with MergedBags(parts) as bags:
        assert find_topics(bags).all == ALL
        assert {topic.name: topic.count for topic in bags.topics} == {
            COLOR: 5, DEPTH: 5, CAMERA: 1}


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_a_part_is_what_lies_between_its_ends(tmp_path: Path, suffix: str) -> None:
    bag = write_bag(tmp_path / f'a{suffix}', entries(6))
    whole = read(bag)
    for start_s, duration_s in ((0.0, None), (0.15, None), (0.2, 0.2), (0.0, 0.35), (0.5, 9.0)):
        low = START_NS + round(start_s * 1e9)
        high = low + round(duration_s * 1e9) if duration_s is not None else START_NS * 2
        found = read(bag, part=BagPart(start_s, duration_s))
        assert [m for m in found if m[0] != CAMERA or not start_s] == [
            m for m in whole if low <= m[1] < high]


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_what_holds_since_before_the_part_comes_first(tmp_path: Path, suffix: str) -> None:
    static = [(STATIC_TF, TRANSFORMS, START_NS + n, transforms(f'child_{n}')) for n in range(2)]
    made = [*static, *entries(4)] if suffix != '.bag' else entries(4)
    bag = write_bag(tmp_path / f'a{suffix}', made)
    with MergedBags([bag], BagPart(0.25)) as bags:
        found = list(bags.messages([*ALL, STATIC_TF]))
    start_ns = START_NS + 250_000_000
    expected = [CAMERA] if suffix == '.bag' else [CAMERA, STATIC_TF, STATIC_TF]
    assert [m.topic for m in found if m.time_ns == start_ns] == expected
    assert min(m.time_ns for m in found) == start_ns
    assert [m.topic for m in found[len(expected):]] == [COLOR, DEPTH]


@pytest.mark.parametrize('suffix', SUFFIXES)
def test_a_start_behind_the_end_says_how_long_the_recording_is(
    tmp_path: Path, suffix: str
) -> None:
    bag = write_bag(tmp_path / f'a{suffix}', entries(4))
    assert read(bag, part=BagPart(0.3))
    with pytest.raises(BagError, match=r'within 0\.300 s, found 0\.31 s'):
        read(bag, part=BagPart(0.31))


def test_damage_of_one_bag_is_told_with_its_name_and_the_others_are_read_whole(
    tmp_path: Path
) -> None:
    made = entries(60)
    first, second = (write_bag(tmp_path / name, part) for name, part in (
        ('first.bag', made[:60]), ('second.bag', made[60:])))
    os.truncate(first, first.stat().st_size // 2)
    with MergedBags([first, second]) as bags:
        times = [m.time_ns for m in bags.messages(ALL)]
        assert bags.damage.startswith(f'{first}: ')
        assert str(second) not in bags.damage
    assert times == sorted(times)
    assert len(times) > len(made[60:])
    assert times[-len(made[60:]):] == [time_ns for _, _, time_ns, _ in made[60:]]


def test_a_bag_without_the_chosen_topics_is_named(tmp_path: Path) -> None:
    made = entries(2)
    other = write_bag(tmp_path / 'other.mcap', [('/other', *made[1][1:])])
    with MergedBags([write_bag(tmp_path / 'a.mcap', made), other]) as bags:
        assert bags.unused(ALL) == [str(other)]


def test_frames_of_two_recordings_far_apart_keep_their_images_and_camera(tmp_path: Path) -> None:
    paths = []
    for number, (start_ns, f) in enumerate(((START_NS, 20.0), (START_NS + 40 * 10**9, 30.0))):
        late = start_ns + 200_000_000  # of colour, which cannot be sure yet that nothing is nearer
        rgb = np.full((12, 16, 3), number, np.uint8)
        depth_m = np.full((12, 16), 1.0 + number, np.float32)
        paths.append(write_bag(tmp_path / f'{number}.mcap', [
            (CAMERA, INFO, late, camera_info(replace(CAM, fx=f), late)),
            (COLOR, IMAGE, late, image(rgb, 'rgb8', late)),
            (DEPTH, IMAGE, late + 1, depth_image(depth_m, '16UC1', start_ns))]))
    pairer: FramePairer[BagMessage] = FramePairer(300_000_000)
    with MergedBags(paths) as bags:
        found = list(paired_frames(bags, find_topics(bags), pairer, lambda: None))
    frames = [frame_from_messages(*(m.read() for m in (f.color, f.depth, f.info))) for f in found]
    assert [(f.rgb[0, 0, 0], f.depth_m[0, 0], f.camera.fx) for f in frames] == [
        (0, 1.0, 20.0), (1, 2.0, 30.0)]


def test_a_bag_that_is_cut_before_its_depth_says_that_it_is_damaged(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / 'a.bag', entries(30))
    text = bag.read_bytes()
    bag.write_bytes(text[:text.index(DEPTH.encode())])
    with MergedBags([bag]) as bags, pytest.raises(BagError, match='may be behind the damage'):
        find_topics(bags)
