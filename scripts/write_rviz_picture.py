"""Draw what rviz shows of results: `python -m scripts.write_rviz_picture FOLDER`.

A synthetic frame goes through `pop replay`, the ROS 1 bag it writes is played to an rviz with the
shipped configuration. Needs ROS 1 with rviz, Xvfb and ImageMagick, as Debian packages them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

from pop_core.body.default_body import default_body
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.frame_bag import write_frame_bag
from pop_ros.node_arguments import SourceArguments
from pop_ros.replay_session import ReplayRequest, run_replay
from scripts.ros1_screen import PACKAGES, Ros1Screen, missing_programs, ros1_screen
from scripts.write_pictures import WALK_SEED

CONFIG = Path(__file__).resolve().parents[1] / 'rviz' / 'pop_ros1.rviz'
FRAMES, SHOWN = 16, 10
SIZE = (1400, 900)
NAME = 'rviz.png'
TOPICS = ('/pop/mesh', '/pop/joints', '/pop/cloud')
MARGIN_PX = 80
COLORED = 24  # difference of a pixel's channels; background and grid are grey


def fitted_bag(work: Path) -> Path:
    """Write a ROS 1 bag with the bodies of a synthetic frame."""
    scene = synthesise_sequence(default_body(), WALK_SEED, FRAMES, rate_hz=10.0)[SHOWN]
    found = [detection for detection in scene.detections() if detection is not None]
    write_openpose_json(work / f'{scene.frame.stamp_ns}.json', found)
    write_frame_bag(work / 'camera', [scene.frame])
    run_replay(ReplayRequest(
        bags=(work / 'camera',), out=work / 'bodies', ros1=work / 'bodies.bag',
        sources=SourceArguments('json', work), topics=(None, None, None), slop_s=0.01,
        every_frame=True), print)
    return work / 'bodies.bag'


def photograph(screen: Ros1Screen, bag: Path, work: Path) -> np.ndarray:
    """Return what rviz shows of a bag once it does not change any more, as RGB."""
    screen.start('rviz', '--fullscreen', '-d', CONFIG)
    for topic in TOPICS:
        screen.wait_for(
            lambda topic=topic: 'rviz' in screen.ask('rostopic', 'info', topic),
            f'rviz listening to {topic}')
    # Messages sent before rviz has connected to the player are lost.
    screen.start('rosbag', 'play', '--quiet', '--keep-alive', '--delay=3', bag)
    seen = [screen.photograph(work / NAME)]

    def has_settled() -> bool:
        seen.append(screen.photograph(work / NAME))
        return bool(np.array_equal(*seen[-2:]) and colored(seen[-1]).any())

    screen.wait_for(has_settled, 'still picture of a body in rviz')
    return seen[-1]


def colored(rgb: np.ndarray) -> np.ndarray:
    """Return the pixels that are not grey."""
    return np.ptp(rgb.astype(int), axis=2) > COLORED


def main(folder: Path) -> None:
    """Write the picture into a folder; leave it as it was where programs are missing."""
    missing = missing_programs()
    if missing:
        print(f'{NAME}: left as it was, there is no {", ".join(missing)} '
              f'(apt-get install {PACKAGES})')
        return
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        bag = fitted_bag(work)
        with ros1_screen(work, SIZE) as screen:
            rgb = photograph(screen, bag, work)
    rows, columns = np.nonzero(colored(rgb))
    top, left = max(rows.min() - MARGIN_PX, 0), max(columns.min() - 2 * MARGIN_PX, 0)
    shown = rgb[top: rows.max() + MARGIN_PX, left: columns.max() + 2 * MARGIN_PX]
    cv2.imwrite(str(folder / NAME), shown[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == '__main__':
    main(Path(sys.argv[1]))
