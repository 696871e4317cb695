"""Compressed recordings and databases are read, and salvaged when they are cut."""

import os
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from support.messages import IMAGE, STORE, image

from pop_ros.bag_reader import BagReader
from pop_ros.ros1_conversion import ROS1_STORE, cdr_to_ros1

START_NS = 1_700_000_000_000_000_000
COUNT = 40
ROS1_FORMATS = {'bz2': Ros1Writer.CompressionFormat.BZ2, 'lz4': Ros1Writer.CompressionFormat.LZ4}


def messages() -> list[bytes]:
    """Return images larger together than one chunk of a recorder."""
    rng = np.random.default_rng(0)
    pixels = [rng.integers(0, 256, (240, 320, 3), dtype=np.uint8) for _ in range(COUNT)]
    return [bytes(STORE.serialize_cdr(image(rgb, 'rgb8', START_NS), IMAGE)) for rgb in pixels]


def write_compressed(folder: Path, kind: str, data: list[bytes]) -> Path:
    """Write messages as a ROS 1 bag (bz2, lz4) or as MCAP (zstd); return the file."""
    if kind != 'zstd':
        path = folder / 'a.bag'
        ros1 = Ros1Writer(path)
        ros1.set_compression(ROS1_FORMATS[kind])
        with ros1:
            topic = ros1.add_connection('/image', IMAGE, typestore=ROS1_STORE)
            for k, message in enumerate(data):
                ros1.write(topic, START_NS + k, cdr_to_ros1(message, IMAGE))
        return path
    ros2 = Ros2Writer(folder / 'a', version=9, storage_plugin=StoragePlugin.MCAP)
    ros2.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with ros2:
        topic = ros2.add_connection('/image', IMAGE, typestore=STORE)
        for k, message in enumerate(data):
            ros2.write(topic, START_NS + k, message)
    return folder / 'a' / 'a.mcap'


@pytest.mark.parametrize('kind', ['bz2', 'lz4', 'zstd'])
def test_a_compressed_recording_gives_what_comes_before_the_cut(tmp_path: Path, kind: str) -> None:
    data = messages()
    path = write_compressed(tmp_path, kind, data)
    with BagReader(path) as bag:
        assert [m.data for m in bag.messages(['/image'])] == data
        assert not bag.damage
    os.truncate(path, int(0.8 * path.stat().st_size))
    with BagReader(path) as bag:
        found = [m.data for m in bag.messages(['/image'])]
        assert bag.damage
    # The chunk that is cut cannot be decompressed.
    assert 0.4 * COUNT < len(found) < COUNT
    assert found == data[:len(found)]


@pytest.mark.parametrize('share', [0.3, 0.7, 0.95])
def test_a_database_that_is_cut_gives_what_comes_before_the_cut(
    tmp_path: Path, share: float
) -> None:
    data = messages()
    with Ros2Writer(tmp_path / 'a', version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        topic = bag.add_connection('/image', IMAGE, typestore=STORE)
        for k, message in enumerate(data):
            bag.write(topic, START_NS + k, message)
    path = tmp_path / 'a' / 'a.db3'
    os.truncate(path, int(share * path.stat().st_size))
    with BagReader(path) as reader:
        found = [m.data for m in reader.messages(['/image'])]
        assert reader.damage
    assert len(found) >= int(0.8 * share * COUNT)
    assert found == data[:len(found)]
