"""What the node is told on its command line beside ROS arguments: keypoints, body, camera."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pop_ros.camera_presets import CAMERA_PRESETS, camera_preset
from pop_ros.keypoint_sources import make_detector
from pop_ros.model_files import PACKAGED, ModelFiles

if TYPE_CHECKING:
    from pop_core.keypoints.detection import KeypointDetector

EPILOG = (
    'Topics are remapped and parameters set as for every node: '
    '--ros-args -r color/image:=/camera/color/image_raw -p sync.slop_s:=0.05'
)


@dataclass(frozen=True, slots=True)
class SourceArguments:
    """Where the node takes keypoints from.

    Args:
        keypoints: 'json', 'depth', the path of an ONNX network or a name of the registry;
            several, with commas between, are merged.
        keypoints_dir: Folder of `<stamp_ns>.json` files for 'json'.
        decoder: Decoder of an ONNX network whose outputs do not tell, or None.
    """

    keypoints: str = 'depth'
    keypoints_dir: Path | None = None
    decoder: str | None = None

    def detector(self) -> KeypointDetector:
        """Return the keypoint source that is named.

        Raises:
            PopError: If there is none, or it lacks what it needs.
        """
        return make_detector(self.keypoints, self.keypoints_dir, self.decoder)

    def as_flags(self) -> list[str]:
        """Return the flags that give these arguments."""
        flags = ['--keypoints', self.keypoints]
        if self.keypoints_dir is not None:
            flags += ['--keypoints-dir', str(self.keypoints_dir)]
        if self.decoder is not None:
            flags += ['--decoder', self.decoder]
        return flags


@dataclass(frozen=True, slots=True)
class NodeArguments:
    """The node's command line without its ROS part.

    Args:
        sources: Where keypoints come from.
        models: Files of body model and pose library.
        camera: Preset of a camera driver whose topics are read, or None.
    """

    sources: SourceArguments
    models: ModelFiles = PACKAGED
    camera: str | None = None

    def as_flags(self) -> list[str]:
        """Return the flags that give these arguments."""
        camera = [] if self.camera is None else ['--camera', self.camera]
        return [*self.sources.as_flags(), *self.models.as_flags(), *camera]

    def as_remappings(self) -> list[str]:
        """Return the ROS arguments that connect the inputs to the camera's topics.

        Raises:
            CameraPresetError: If there is no such camera.
        """
        if self.camera is None:
            return []
        topics = camera_preset(self.camera).topics
        return ['--ros-args', '-r', f'color/image:={topics.color}',
                '-r', f'depth/image:={topics.depth}', '-r', f'color/camera_info:={topics.info}']


def parse_arguments(arguments: Sequence[str]) -> NodeArguments:
    """Return the arguments of a command line without its ROS part; exits with 2 on a bad one."""
    parser = argparse.ArgumentParser(
        prog='pop node', epilog=EPILOG,
        description='Fit people to RGB-D images: mesh, joints and points of every person.')
    parser.add_argument(
        '--keypoints', action='append', metavar='SOURCE',
        help='depth (the embedded network, coarse; the default), json (OpenPose files), the path '
             'of an ONNX network, or a name of "pop models list"; several, given again or with '
             'commas between, are merged')
    parser.add_argument(
        '--keypoints-dir', type=Path, metavar='DIR',
        help='folder of OpenPose files named <stamp_ns>.json, for --keypoints json')
    parser.add_argument(
        '--decoder', metavar='NAME', help='decoder of a network whose outputs do not tell')
    parser.add_argument(
        '--body', type=Path, metavar='FILE',
        help='body model that is fitted, made by "pop body import" of your SMPL, SMPL-H, SMPL-X '
             'or STAR file; without it, the default body')
    parser.add_argument(
        '--library', type=Path, metavar='FILE',
        help='pose library made by "pop library build"; without it, the default one')
    parser.add_argument(
        '--camera', choices=sorted(CAMERA_PRESETS),
        help='read the topics of this driver; remappings given beside it win')
    found = parser.parse_args(arguments)
    keypoints = ','.join(found.keypoints or ['depth'])
    sources = SourceArguments(keypoints, found.keypoints_dir, found.decoder)
    return NodeArguments(sources, ModelFiles(found.body, found.library), found.camera)
