"""Make a rosbag2 of RGB-D frames on disk, as if a camera driver had recorded them."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pop_core.errors import PopError
from pop_core.rgbd import RgbdFrame
from pop_ros.bag_reader import BagError
from pop_ros.bag_topics import RgbdTopics
from pop_ros.frame_bag import CAMERA_FRAME, write_frame_bag
from pop_ros.frame_folder import FrameFolder, find_frames, load_frame

START_NS = 1_700_000_000_000_000_000  # a time of recording: stamp 0 means "not known" in ROS


@dataclass(slots=True)
class MadeBag:
    """What a bag was made of.

    Args:
        topics: Its topics.
        frames: Frames written.
        refused: What was wrong with each frame that was left out.
        keypoints: OpenPose files that were copied.
    """

    topics: RgbdTopics | None = None
    frames: int = 0
    refused: list[str] | None = None
    keypoints: int = 0


def make_bag(
    folder: Path,
    out: Path,
    *,
    rate_hz: float,
    frame_id: str = CAMERA_FRAME,
    keypoints_dir: Path | None = None,
    on_frame: Callable[[int, int], None] = lambda _done, _total: None,
) -> MadeBag:
    """Write the frames of a folder as a rosbag2, in the order of their names.

    Args:
        folder: A frame folder, or one with frame folders below it.
        out: New rosbag2 folder.
        rate_hz: Frames per second of the bag.
        frame_id: Frame of the colour camera.
        keypoints_dir: Where to copy the frames' OpenPose files, named by stamp, or None.
        on_frame: Told how many frames of how many are done.

    Raises:
        FrameError: If there is no frame.
        BagError: If `out` exists, or no frame could be read.
    """
    folders = find_frames(folder)
    made = MadeBag(refused=[])
    stamped = _stamped(folders, rate_hz, made, on_frame)
    made.topics = write_frame_bag(
        out, _with_keypoints(stamped, keypoints_dir, made), frame_id=frame_id)
    if not made.frames:
        shutil.rmtree(out)
        raise BagError(f'{folder}: expected frames, found none that can be read')
    return made


def _stamped(
    folders: Sequence[FrameFolder], rate_hz: float, made: MadeBag,
    on_frame: Callable[[int, int], None],
) -> Iterator[tuple[FrameFolder, RgbdFrame]]:
    """Yield the frames that can be read; a frame that cannot leaves a gap in time."""
    for number, folder in enumerate(folders):
        try:
            frame = load_frame(folder.path)
        except (PopError, OSError) as error:
            assert made.refused is not None
            made.refused.append(str(error))
        else:
            yield folder, replace(frame, stamp_ns=START_NS + round(number * 1e9 / rate_hz))
            made.frames += 1
        on_frame(number + 1, len(folders))


def _with_keypoints(
    stamped: Iterator[tuple[FrameFolder, RgbdFrame]], keypoints_dir: Path | None, made: MadeBag
) -> Iterator[RgbdFrame]:
    for folder, frame in stamped:
        if keypoints_dir is not None and folder.keypoints.is_file():
            keypoints_dir.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder.keypoints, keypoints_dir / f'{frame.stamp_ns}.json')
            made.keypoints += 1
        yield frame
