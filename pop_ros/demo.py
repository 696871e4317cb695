"""The demo: a half-hidden person, synthesised, played to the node over DDS, recorded and shown."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from pop_core.body.default_body import default_body
from pop_core.errors import PopError
from pop_core.estimate import JointState
from pop_core.keypoints.openpose_json import write_openpose_json
from pop_core.rendering.pictures import extent_of, four_panels
from pop_core.rendering.shown_body import ShownBody
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.sequence import synthesise_sequence
from pop_ros.frame_bag import write_frame_bag
from pop_ros.node_arguments import SourceArguments
from pop_ros.recorded_bodies import RecordedFrame, read_bodies, shown_bodies
from pop_ros.replay import ReplaySummary
from pop_ros.replay_pace import Pace
from pop_ros.replay_session import ReplayRequest, run_replay
from pop_ros.report3d import SceneFrame
from pop_ros.result_folder import write_png

RATE_HZ = 10.0
SECONDS_PER_FRAME = 2.0  # slow enough that the node fits every frame on a small machine
MARKER = '.pop_demo'
PELVIS = 0


class DemoError(PopError):
    """An output folder that is somebody else's, or a node that published nothing."""


@dataclass(frozen=True, slots=True)
class DemoPaths:
    """Where the demo writes."""

    root: Path

    @property
    def camera_bag(self) -> Path:
        """Return the bag a camera would have recorded."""
        return self.root / 'camera_bag'

    @property
    def keypoints(self) -> Path:
        """Return the folder of OpenPose files by stamp."""
        return self.root / 'keypoints'

    @property
    def bodies_bag(self) -> Path:
        """Return the bag of what the node published."""
        return self.root / 'bodies_bag'

    @property
    def pictures(self) -> Path:
        """Return the folder of pictures."""
        return self.root / 'pictures'

    @property
    def report(self) -> Path:
        """Return the report."""
        return self.root / 'report.html'


@dataclass(frozen=True, slots=True, eq=False)
class DemoFrame:
    """One frame of the demo that the node has fitted.

    Args:
        picture: Its four panels.
        errors_m: Distance of each joint from the truth [m].
        hidden: Joints that the camera does not see, by the truth.
        scene: The frame and its people, to be shown in 3D.
    """

    picture: np.ndarray
    errors_m: np.ndarray
    hidden: np.ndarray
    scene: SceneFrame | None = None


def prepare_folder(root: Path) -> DemoPaths:
    """Return the paths of a demo in a new or empty folder, or in that of an earlier demo.

    Raises:
        DemoError: If the folder holds anything else: nothing of the user's is ever removed.
    """
    paths = DemoPaths(root)
    marker = root / MARKER
    if root.is_dir() and any(root.iterdir()) and not marker.is_file():
        raise DemoError(f'{root}: expected a new or empty folder, found files of someone else')
    root.mkdir(parents=True, exist_ok=True)
    for folder in (paths.camera_bag, paths.keypoints, paths.bodies_bag, paths.pictures):
        shutil.rmtree(folder, ignore_errors=True)
    marker.touch()
    return paths


def record_scenes(
    paths: DemoPaths, n_frames: int, seed: int, progress: Callable[[int], None]
) -> list[SyntheticScene]:
    """Synthesise a walk behind a table and write it as a bag and OpenPose files."""
    scenes = synthesise_sequence(
        default_body(), seed, n_frames, rate_hz=RATE_HZ, progress=progress)
    write_frame_bag(paths.camera_bag, [scene.frame for scene in scenes])
    paths.keypoints.mkdir()
    for scene in scenes:
        found = [detection for detection in scene.detections() if detection is not None]
        write_openpose_json(paths.keypoints / f'{scene.frame.stamp_ns}.json', found)
    return scenes


class DemoKeypoints(Enum):
    """Where the demo's node takes keypoints from."""

    DEPTH = 'depth'
    TRUTH = 'truth'


def source_of(paths: DemoPaths, keypoints: DemoKeypoints) -> SourceArguments:
    """Return the node's keypoint source: the embedded network, or noisy truth from files."""
    if keypoints is DemoKeypoints.TRUTH:
        return SourceArguments('json', paths.keypoints)
    return SourceArguments()


def play_to_node(
    paths: DemoPaths, keypoints: DemoKeypoints, say: Callable[[str], None]
) -> ReplaySummary:
    """Play the bag to a node in its own process and record what it publishes."""
    request = ReplayRequest(
        bags=(paths.camera_bag,), out=paths.bodies_bag, ros1=None,
        sources=source_of(paths, keypoints), topics=(None, None, None), slop_s=0.01,
        pace=Pace(rate=1 / (RATE_HZ * SECONDS_PER_FRAME)))
    return run_replay(request, say)


def draw_frames(
    paths: DemoPaths, scenes: Sequence[SyntheticScene], progress: Callable[[], None]
) -> list[DemoFrame]:
    """Draw every recorded frame, write the pictures and compare with the truth.

    Raises:
        DemoError: If nothing was recorded.
    """
    recorded = read_bodies(paths.bodies_bag)
    model = default_body()
    paths.pictures.mkdir()
    frames, extent = [], np.zeros((0, 3))
    for number, scene in enumerate(scenes):
        progress()
        published = recorded.get(scene.frame.stamp_ns)
        if published is None or not len(published.joints):
            continue
        bodies = shown_bodies(published, scene.frame, model)
        extent = np.concatenate([extent, extent_of(bodies)])
        frame = _demo_frame(scene, published, bodies, four_panels(
            scene.frame, bodies, model.f, extent))
        write_png(paths.pictures / f'frame_{number:03d}.png', frame.picture)
        frames.append(frame)
    if not frames:
        raise DemoError(f'{paths.bodies_bag}: expected fitted people, found none recorded')
    return frames


def _demo_frame(
    scene: SyntheticScene, published: RecordedFrame, bodies: Sequence[ShownBody],
    picture: np.ndarray,
) -> DemoFrame:
    truth = scene.people[0]
    to_pelvis = np.linalg.norm(published.joints[:, PELVIS] - truth.joints[PELVIS], axis=1)
    nearest = published.joints[int(to_pelvis.argmin())]
    errors_m = np.linalg.norm(nearest - truth.joints, axis=1)
    return DemoFrame(
        picture, errors_m, truth.joint_state != JointState.VISIBLE,
        SceneFrame(scene.frame, bodies, f'stamp {scene.frame.stamp_ns / 1e9:.1f} s'))
