"""The page the demo ends with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pop_core import __version__
from pop_core.body.default_body import default_body
from pop_ros.demo import DemoFrame, DemoKeypoints, DemoPaths, source_of
from pop_ros.replay import ReplaySummary
from pop_ros.report import Picture, Report
from pop_ros.show_recording import HOW_TO_TURN, LEGEND, MAX_SCENES, PAGE_PX

LEAD = (
    'A synthetic person walks behind a table. A ROS 2 node in its own process received the '
    'recording over DDS and published a mesh, joints and points for every frame it had time '
    'for; what you see was read back from the bag of its outputs.')


ABOUT = {
    DemoKeypoints.DEPTH:
        'The person was found in depth by the small network that comes with the package, whose '
        'limbs are coarse; pop demo --keypoints truth shows what a good RGB network leads to.',
    DemoKeypoints.TRUTH:
        'Keypoints are the truth with the noise, misses and outliers of a good RGB network.',
}


def write_demo_report(
    paths: DemoPaths, frames: Sequence[DemoFrame], summary: ReplaySummary,
    keypoints: DemoKeypoints,
) -> None:
    """Write the report of a demo."""
    report = Report('pop: a body, hidden limbs included', LEAD)
    report.film([Picture.encoded(f.picture, _caption(f), PAGE_PX) for f in frames])
    report.text(LEGEND)
    scenes = [frame.scene for frame in frames if frame.scene is not None]
    if scenes:
        report.heading('Walk around it')
        report.scenes(scenes[::math.ceil(len(scenes) / MAX_SCENES)], default_body().f)
        report.text(HOW_TO_TURN)
    report.heading('Distance of joints from the truth')
    report.table(('joints', 'count', 'mean', 'median', '90 %'), error_rows(frames))
    report.text(
        f'{ABOUT[keypoints]} One short sequence is a demonstration and no benchmark; for figures, '
        'run python -m benchmarks accuracy.')
    report.heading('What the node said')
    report.commands(summary.text().splitlines())
    report.heading('Look further')
    report.commands(commands(paths, keypoints))
    report.text(f'Written by pop {__version__}.')
    report.write(paths.report)


def error_rows(frames: Sequence[DemoFrame]) -> list[tuple[str, ...]]:
    """Return the rows (name, count, mean, median, 90th percentile) of the joints' errors."""
    errors_m = np.concatenate([frame.errors_m for frame in frames])
    hidden = np.concatenate([frame.hidden for frame in frames])
    groups = {'visible': errors_m[~hidden], 'hidden': errors_m[hidden]}
    return [
        (name, str(len(values)), *(f'{1000 * value:.0f} mm' for value in (
            values.mean(), np.median(values), np.percentile(values, 90))))
        for name, values in groups.items() if len(values)]


def _caption(frame: DemoFrame) -> str:
    hidden = frame.errors_m[frame.hidden]
    seen = frame.errors_m[~frame.hidden]
    parts = [f'{len(seen)} visible joints off by {1000 * seen.mean():.0f} mm'] if len(seen) else []
    if len(hidden):
        parts.append(f'{len(hidden)} hidden ones by {1000 * hidden.mean():.0f} mm')
    return ', '.join(parts) + ' in the mean'


def commands(paths: DemoPaths, keypoints: DemoKeypoints) -> list[str]:
    """Return what to type to go on with a demo."""
    flags = ' '.join(source_of(DemoPaths(Path()), keypoints).as_flags())
    return [
        f'cd {paths.root.resolve()}',
        f'pop replay {paths.camera_bag.name} {flags} --every-frame --out bodies_again',
        f'ros2 bag play {paths.bodies_bag.name}    # with rviz2 beside it',
    ]
