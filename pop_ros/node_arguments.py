"""What the node is told on its command line beside ROS arguments: where keypoints come from."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

EPILOG = (
    'Topics are remapped and parameters set as for every node: '
    '--ros-args -r color/image:=/camera/color/image_raw -p sync.slop_s:=0.05'
)


@dataclass(frozen=True, slots=True)
class SourceArguments:
    """Where the node takes keypoints from.

    Args:
        keypoints: 'json', 'depth' or the path of an ONNX network.
        keypoints_dir: Folder of `<stamp_ns>.json` files for 'json'.
        decoder: Decoder of an ONNX network whose outputs do not tell, or None.
    """

    keypoints: str = 'depth'
    keypoints_dir: Path | None = None
    decoder: str | None = None

    def as_flags(self) -> list[str]:
        """Return the flags that give these arguments."""
        flags = ['--keypoints', self.keypoints]
        if self.keypoints_dir is not None:
            flags += ['--keypoints-dir', str(self.keypoints_dir)]
        if self.decoder is not None:
            flags += ['--decoder', self.decoder]
        return flags


def parse_arguments(arguments: Sequence[str]) -> SourceArguments:
    """Return the arguments of a command line without its ROS part; exits with 2 on a bad one."""
    parser = argparse.ArgumentParser(
        prog='pop node', epilog=EPILOG,
        description='Fit people to RGB-D images: mesh, joints and points of every person.')
    parser.add_argument(
        '--keypoints', default='depth', metavar='SOURCE',
        help='json, depth (embedded network) or the path of an ONNX network')
    parser.add_argument(
        '--keypoints-dir', type=Path, metavar='DIR',
        help='folder of OpenPose files named <stamp_ns>.json, for --keypoints json')
    parser.add_argument(
        '--decoder', metavar='NAME', help='decoder of a network whose outputs do not tell')
    found = parser.parse_args(arguments)
    return SourceArguments(found.keypoints, found.keypoints_dir, found.decoder)
