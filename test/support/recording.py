"""A synthetic recording with known truth, as bags and OpenPose files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from support.bags import rgbd_entries, write_bag
from support.messages import camera_info, depth_image, image

from pop_core.body.default_body import default_body
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.rgbd import RgbdFrame
from pop_core.synthesis.keypoints import KeypointNoise
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.sequence import synthesise_sequence

# A good detector: these tests ask whether data arrives unharmed, not how well fits are.
CAREFUL = KeypointNoise(
    sigma_px=(1.0, 1.5), missing=0.0, outliers=0.0, swaps=0.0, hidden_by_scene=0.0)


@dataclass(frozen=True)
class Recording:
    """Scenes of one walk and the folder of their OpenPose files."""

    scenes: list[SyntheticScene]
    keypoints: Path

    @property
    def stamps(self) -> list[int]:
        return [scene.frame.stamp_ns for scene in self.scenes]

    def pelvis(self, stamp_ns: int) -> np.ndarray:
        return self.scenes[self.stamps.index(stamp_ns)].people[0].joints[0]

    def person_mask(self, stamp_ns: int) -> np.ndarray:
        return self.scenes[self.stamps.index(stamp_ns)].people[0].mask

    def write(self, path: Path, depth_encoding: str) -> Path:
        return write_frames(path, [scene.frame for scene in self.scenes], depth_encoding)


def record(folder: Path, n_frames: int, rate_hz: float) -> Recording:
    """Synthesise a walk and write what a keypoint detector says about it."""
    scenes = synthesise_sequence(default_body(), 4, n_frames, rate_hz=rate_hz)
    for scene in scenes:
        found = [d for d in scene.detections(CAREFUL) if d is not None]
        write_openpose_json(folder / f'{scene.frame.stamp_ns}.json', found)
    return Recording(scenes, folder)


def write_frames(path: Path, frames: list[RgbdFrame], depth_encoding: str) -> Path:
    """Write frames as a bag of the kind that the suffix names."""
    return write_bag(path, rgbd_entries(_messages(f, depth_encoding) for f in frames))


def _messages(frame: RgbdFrame, depth_encoding: str) -> tuple[int, Any, Any, Any]:
    stamp = frame.stamp_ns
    return (stamp, image(frame.rgb, 'rgb8', stamp),
            depth_image(frame.depth_m, depth_encoding, stamp), camera_info(frame.camera, stamp))
