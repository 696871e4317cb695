"""Write what the node sees and finds in one frame, so that `pop fit` can repeat it at a desk."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from pop_core.body.model import BodyModel
from pop_core.estimate import FrameResult
from pop_core.keypoints.detection import Detection
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.rgbd import RgbdFrame
from pop_ros.camera_file import camera_json
from pop_ros.image_messages import depth_mm
from pop_ros.result_folder import write_png, write_results


def save_snapshot(
    root: Path, frame: RgbdFrame, detections: Sequence[Detection], result: FrameResult,
    model: BodyModel,
) -> Path:
    """Write a frame folder named by the stamp, the result below it; return the folder.

    Raises:
        OSError: If it cannot be written.
    """
    folder = root.expanduser().resolve() / str(frame.stamp_ns)
    folder.mkdir(parents=True, exist_ok=True)
    write_png(folder / 'color.png', frame.rgb)
    write_png(folder / 'depth.png', depth_mm(frame.depth_m))
    camera = json.dumps(camera_json(frame.camera), indent=1)
    (folder / 'camera.json').write_text(f'{camera}\n', encoding='utf-8')
    write_openpose_json(folder / 'keypoints.json', detections)
    write_results(folder / 'result', frame, result, model)
    return folder
