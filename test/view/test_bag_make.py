"""`pop bag make`: frames on disk come back from the bag as they were."""

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from pop_core.errors import FrameError
from pop_core.geometry.camera import Camera
from pop_core.rgbd import RgbdFrame
from pop_core.tracking.detection_schedule import LONG_GAP_S
from pop_ros.bag_commands import FRAME_RATE_HZ
from pop_ros.bag_make import make_bag
from pop_ros.bag_reader import BagError, BagReader
from pop_ros.bag_topics import find_topics
from pop_ros.camera_file import camera_json
from pop_ros.cli import main
from pop_ros.from_messages import frame_from_messages, stamp_ns

CAMERA = Camera(
    16, 12, 20.0, 21.0, 7.5, 5.5, 'plumb_bob', np.array([0.1, -0.2, 0.001, 0.002, 0.03]))


@pytest.fixture
def frames(tmp_path: Path) -> Path:
    """Three frames below one camera file; the second has keypoints."""
    root = tmp_path / 'frames'
    rng = np.random.default_rng(0)
    for k in range(3):
        folder = root / f'{k:02d}'
        folder.mkdir(parents=True)
        cv2.imwrite(str(folder / 'color.png'), rng.integers(0, 256, (12, 16, 3), dtype=np.uint8))
        cv2.imwrite(str(folder / 'depth.png'), 700 * rng.integers(0, 3, (12, 16), np.uint16))
    (root / 'camera.json').write_text(json.dumps(camera_json(CAMERA)))
    (root / '01' / 'keypoints.json').write_text('{"people": []}')
    return root


def read_back(bag: Path) -> list[RgbdFrame]:
    with BagReader(bag) as reader:
        topics = find_topics(reader)
        parts = [[m.read() for m in reader.messages([topic])] for topic in topics.all]
    return [frame_from_messages(*messages) for messages in zip(*parts, strict=True)]


def test_frames_come_back_in_order_with_their_camera_and_evenly_stamped(
    frames: Path, tmp_path: Path
) -> None:
    made = make_bag(frames, tmp_path / 'bag', rate_hz=4.0)
    found = read_back(tmp_path / 'bag')
    assert made.frames == len(found) == 3
    assert np.diff([frame.stamp_ns for frame in found]).tolist() == [250_000_000] * 2
    for k, frame in enumerate(found):
        bgr = cv2.imread(str(frames / f'{k:02d}' / 'color.png'))
        depth_mm = cv2.imread(str(frames / f'{k:02d}' / 'depth.png'), cv2.IMREAD_UNCHANGED)
        assert np.array_equal(frame.rgb, bgr[..., ::-1])
        assert np.array_equal(np.isnan(frame.depth_m), depth_mm == 0)
        np.testing.assert_allclose(np.nan_to_num(frame.depth_m), depth_mm / 1000, atol=1e-6)
        assert np.array_equal(frame.camera.K, CAMERA.K)
        assert np.array_equal(frame.camera.d, CAMERA.d)


def test_keypoints_are_named_by_the_stamp_of_their_frame(frames: Path, tmp_path: Path) -> None:
    made = make_bag(frames, tmp_path / 'bag', rate_hz=4.0, keypoints_dir=tmp_path / 'kp')
    second = read_back(tmp_path / 'bag')[1].stamp_ns
    assert made.keypoints == 1
    assert [path.name for path in (tmp_path / 'kp').iterdir()] == [f'{second}.json']


def test_the_frame_of_the_camera_is_the_one_that_was_named(frames: Path, tmp_path: Path) -> None:
    make_bag(frames, tmp_path / 'bag', rate_hz=4.0, frame_id='my_camera')
    with BagReader(tmp_path / 'bag') as bag:
        headers = [m.read().header for m in bag.messages([t.name for t in bag.topics])]
    assert {header.frame_id for header in headers} == {'my_camera'}
    assert all(stamp_ns(header) > 0 for header in headers)


def test_a_broken_frame_is_told_and_leaves_a_gap(
    frames: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (frames / '01' / 'depth.png').write_bytes(b'no picture')
    out = tmp_path / 'bag'
    monkeypatch.setattr(sys, 'argv', ['pop', 'bag', 'make', str(frames), '--out', str(out)])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    told = capsys.readouterr()
    assert '2 frames in' in told.out
    assert str(frames / '01' / 'depth.png') in told.err
    first, third = (frame.stamp_ns for frame in read_back(out))
    assert third - first == round(2e9 / FRAME_RATE_HZ)
    assert (third - first) / 2e9 > LONG_GAP_S  # people are looked for in every frame


def test_a_folder_without_a_readable_frame_leaves_no_bag(frames: Path, tmp_path: Path) -> None:
    (frames / 'camera.json').unlink()
    with pytest.raises(BagError, match='found none that can be read'):
        make_bag(frames, tmp_path / 'bag', rate_hz=4.0)
    assert not (tmp_path / 'bag').exists()


def test_a_folder_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(FrameError, match='nothing there'):
        make_bag(tmp_path / 'missing', tmp_path / 'bag', rate_hz=4.0)
