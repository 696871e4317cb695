"""Frame folders that hold a person, made without any file of the outside."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from pop_core.body.default_body import default_body
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.rgbd import RgbdFrame
from pop_ros.camera_file import camera_json
from pop_ros.warm_up import small_scene


@pytest.fixture(scope='session')
def scene() -> tuple[RgbdFrame, Detection]:
    """Return a small frame of one person in front of a wall, and the person's keypoints."""
    return small_scene(default_body())


def write_frame(folder: Path, frame: RgbdFrame, people: list[Detection] | None) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    depth_mm = np.rint(np.nan_to_num(frame.depth_m) * 1000).astype(np.uint16)
    cv2.imwrite(str(folder / 'color.png'), frame.rgb[..., ::-1])
    cv2.imwrite(str(folder / 'depth.png'), depth_mm)
    (folder / 'camera.json').write_text(json.dumps(camera_json(frame.camera)))
    if people is not None:
        write_openpose_json(folder / 'keypoints.json', people)
    return folder
