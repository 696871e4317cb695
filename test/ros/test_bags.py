"""Bags of every kind are read alike, damaged ones as far as they go."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from support.bags import CAMERA, COLOR, DEPTH, Entry, rgbd_entries, write_bag
from support.messages import IMAGE, camera_info, depth_image, image

from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_reader import BagError, BagReader
from pop_ros.bag_topics import ImageTopic, choose_color, choose_depth, choose_info, find_topics
from pop_ros.bag_writer import BagWriter
from pop_ros.cdr import MarkerTemplate
from pop_ros.frame_bag import write_frame_bag
from pop_ros.from_messages import decode_color, decode_depth, frame_from_messages, stamp_ns
from pop_ros.to_messages import joints_message, make_header, mesh_marker

SUFFIXES = ('.bag', '.db3', '.mcap')
CAM = Camera(16, 12, 20.0, 20.0, 7.5, 5.5)
START_NS = 1_700_000_000_000_000_000
STEP_NS = 33_333_333


def entries(count: int, encoding: str = '16UC1') -> list[Entry]:
    rng = np.random.default_rng(4)
    frames = []
    for k in range(count):
        stamp = START_NS + k * STEP_NS
        rgb = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
        depth_m = rng.integers(500, 4000, (12, 16)).astype(np.float32) / 1000
        frames.append((stamp, image(rgb, 'rgb8', stamp), depth_image(depth_m, encoding, stamp),
                       camera_info(CAM, stamp)))
    return rgbd_entries(frames)


@pytest.mark.parametrize('suffix', SUFFIXES)
@pytest.mark.parametrize('encoding', ['16UC1', '32FC1'])
def test_every_kind_of_bag_gives_the_messages_that_were_written(
    tmp_path: Path, suffix: str, encoding: str
) -> None:
    written = entries(3, encoding)
    with BagReader(write_bag(tmp_path / f'a{suffix}', written)) as bag:
        topics = find_topics(bag)
        assert topics.all == (COLOR, DEPTH, CAMERA)
        found = list(bag.messages(topics.all))
        assert not bag.damage
    assert [m.topic for m in found] == [topic for topic, *_ in written]
    for message, (topic, _, time_ns, original) in zip(found, written, strict=True):
        read = message.read()
        assert message.time_ns == time_ns
        assert stamp_ns(read.header) == stamp_ns(original.header)
        assert read.header.frame_id == original.header.frame_id
        if topic == COLOR:
            assert np.array_equal(decode_color(read), decode_color(original))
        elif topic == DEPTH:
            assert np.array_equal(decode_depth(read), decode_depth(original), equal_nan=True)
        else:
            assert np.array_equal(read.k, original.k)


@pytest.mark.parametrize('suffix', SUFFIXES[1:])
def test_a_rosbag2_file_without_its_folder_is_read_too(tmp_path: Path, suffix: str) -> None:
    folder = write_bag(tmp_path / f'a{suffix}', entries(2))
    (folder / 'metadata.yaml').unlink()
    for path in (folder, next(folder.glob(f'*{suffix}'))):
        with BagReader(path) as bag:
            assert len(list(bag.messages([COLOR]))) == 2


def test_a_rosbag2_folder_may_be_named_like_a_ros1_bag(tmp_path: Path) -> None:
    folder = write_bag(tmp_path / 'a.mcap', entries(2)).rename(tmp_path / 'results.bag')
    with BagReader(folder) as bag:
        assert len(list(bag.messages([COLOR]))) == 2


@pytest.mark.parametrize('suffix', ['.bag', '.mcap'])
@pytest.mark.parametrize('share', [0.3, 0.6, 0.95])
def test_a_truncated_bag_gives_the_messages_before_the_cut(
    tmp_path: Path, suffix: str, share: float
) -> None:
    path = write_bag(tmp_path / f'a{suffix}', entries(60))
    file = path if path.is_file() else next(path.glob('*.mcap'))
    with BagReader(file) as bag:
        whole = [m.data for m in bag.messages((COLOR, DEPTH))]
    os.truncate(file, int(share * file.stat().st_size))
    with BagReader(file) as bag:
        found = [m.data for m in bag.messages((COLOR, DEPTH))]
        assert bag.damage
    # An index, where the format has one, stands behind the messages.
    assert len(found) >= int(0.8 * share * len(whole))
    assert found == whole[:len(found)]


def test_a_damaged_database_gives_what_comes_before_and_says_so(tmp_path: Path) -> None:
    folder = write_bag(tmp_path / 'a.db3', entries(60))
    file = next(folder.glob('*.db3'))
    size = file.stat().st_size
    with file.open('r+b') as opened:
        opened.seek(int(0.7 * size))
        opened.write(os.urandom(int(0.2 * size)))
    with BagReader(folder) as bag:
        found = list(bag.messages((COLOR, DEPTH)))
        assert bag.damage
    assert 0 < len(found) < 120


def test_a_bag_that_was_never_closed_is_read(tmp_path: Path) -> None:
    path = write_bag(tmp_path / 'a.bag', entries(4))
    data = bytearray(path.read_bytes())
    at = data.index(b'index_pos=') + len(b'index_pos=')
    data[at: at + 8] = bytes(8)  # what a recorder writes before it knows where the index is
    active = tmp_path / 'a.bag.active'
    active.write_bytes(data)
    with BagReader(active) as bag:
        assert len(list(bag.messages([DEPTH]))) == 4
        assert 'never finished' in bag.damage


@pytest.mark.parametrize('content', [b'', b'no bag at all', b'#ROSBAG V2.0\n'])
@pytest.mark.parametrize('suffix', SUFFIXES)
def test_a_file_that_is_no_bag_is_refused_by_name(
    tmp_path: Path, suffix: str, content: bytes
) -> None:
    path = tmp_path / f'a{suffix}'
    path.write_bytes(content)
    with pytest.raises(BagError, match=re.escape(str(path))), BagReader(path):
        pass


def test_a_missing_bag_and_an_empty_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / 'none.bag', tmp_path):
        with pytest.raises(BagError, match='expected'):
            BagReader(path)


def test_topics_are_chosen_by_encoding_and_name() -> None:
    images = [
        ImageTopic('/cam/infra1/image_rect_raw', 'mono8'),
        ImageTopic('/cam/depth/image_rect_raw', '16UC1'),
        ImageTopic('/cam/aligned_depth_to_color/image_raw', '16UC1'),
        ImageTopic('/cam/color/image_raw', 'rgb8'),
        ImageTopic('/debug/overlay', 'bgr8'),
    ]
    infos = ['/cam/depth/camera_info', '/cam/infra1/camera_info', '/cam/color/camera_info']
    assert choose_color(images, infos) == '/cam/color/image_raw'
    assert choose_depth(images) == '/cam/aligned_depth_to_color/image_raw'
    assert choose_info('/cam/color/image_raw', infos) == '/cam/color/camera_info'
    assert choose_info('/cam/color/rect/image', infos) == '/cam/color/camera_info'


def test_a_bag_without_depth_says_what_it_has(tmp_path: Path) -> None:
    written = [entry for entry in entries(1) if entry[0] != DEPTH]
    with (BagReader(write_bag(tmp_path / 'a.mcap', written)) as bag,
          pytest.raises(BagError, match=rf'no depth image in .*{COLOR} \(Image, 1\)')):
        find_topics(bag)


def test_a_named_topic_must_exist(tmp_path: Path) -> None:
    with (BagReader(write_bag(tmp_path / 'a.mcap', entries(1))) as bag,
          pytest.raises(BagError, match='expected topic /other')):
        find_topics(bag, color='/other')


def test_frames_survive_the_trip_through_a_bag(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    rgb = rng.integers(0, 256, (12, 16, 3), dtype=np.uint8)
    depth_m = rng.integers(400, 5000, (12, 16)).astype(np.float32) / 1000
    depth_m[3, 4] = np.nan
    frame = RgbdFrame(rgb, depth_m, CAM, START_NS)
    topics = write_frame_bag(tmp_path / 'out', [frame])
    with BagReader(tmp_path / 'out') as bag:
        assert find_topics(bag) == topics
        read = {m.topic: m.read() for m in bag.messages(topics.all)}
    found = frame_from_messages(read[topics.color], read[topics.depth], read[topics.info])
    assert found.stamp_ns == START_NS
    assert np.array_equal(found.rgb, rgb)
    np.testing.assert_allclose(found.depth_m, depth_m, rtol=1e-6)


def test_an_existing_recording_is_never_overwritten(tmp_path: Path) -> None:
    existing = tmp_path / 'a.bag'
    existing.write_text('precious')
    with pytest.raises(BagError, match='found one there already'):
        BagWriter(tmp_path / 'new', existing)
    assert existing.read_text() == 'precious'


def write_marker_and_poses(tmp_path: Path) -> tuple[np.ndarray, Path]:
    points = np.random.default_rng(0).normal(size=(90, 3))
    marker = MarkerTemplate(mesh_marker(2, 'camera', 0.0)).message(START_NS, points)
    poses = bytes(serialize_message(joints_message([], make_header(START_NS, 'camera'))))
    with BagWriter(tmp_path / 'out', tmp_path / 'out.bag') as bag:
        bag.write('/pop/mesh', 'visualization_msgs/msg/Marker', START_NS, bytes(marker))
        bag.write('/pop/joints', 'geometry_msgs/msg/PoseArray', START_NS, poses)
    return points, tmp_path / 'out.bag'


def test_a_marker_reads_the_same_from_ros1_and_ros2_bags(tmp_path: Path) -> None:
    points, _ = write_marker_and_poses(tmp_path)
    for path in (tmp_path / 'out', tmp_path / 'out.bag'):
        with AnyReader([path]) as bag:
            wanted = [c for c in bag.connections if c.topic == '/pop/mesh']
            (connection, time_ns, raw), = bag.messages(wanted)
            marker = bag.deserialize(raw, connection.msgtype)
        assert time_ns == START_NS == stamp_ns(marker.header)
        assert (marker.id, marker.header.frame_id) == (2, 'camera')
        assert [[p.x, p.y, p.z] for p in marker.points] == points.tolist()


def test_the_ros1_bag_is_one_that_rosbag_itself_reads(tmp_path: Path) -> None:
    rosbag = shutil.which('rosbag')
    if rosbag is None:
        pytest.skip('rosbag of ROS 1 is not installed (apt-get install python3-rosbag rosbag)')
    _, path = write_marker_and_poses(tmp_path)
    told = subprocess.run(
        [rosbag, 'info', str(path)], capture_output=True, text=True, check=True, timeout=60,
        env={k: v for k, v in os.environ.items() if not k.startswith('PYTHON')})
    assert '/pop/mesh' in told.stdout, (told.stderr, sys.version)
    assert 'geometry_msgs/PoseArray' in told.stdout


def test_image_topics_without_messages_are_no_candidates(tmp_path: Path) -> None:
    with BagWriter(tmp_path / 'out') as writer:
        writer.add_topic('/cam/rgb', IMAGE)
        writer.write('/x', IMAGE, 1, bytes(serialize_message_of_image()))
    with (BagReader(tmp_path / 'out') as bag,
          pytest.raises(BagError, match='expected an RGB-D camera')):
        find_topics(bag)


def serialize_message_of_image() -> bytes:
    from support.messages import STORE
    message = image(np.zeros((2, 2), np.uint8), 'mono8')
    return bytes(STORE.serialize_cdr(message, IMAGE))
