"""`pop demo`: from nothing to pictures of a fitted, half-hidden person."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def demo(
    out: Annotated[Path, typer.Option('--out', help='New folder, or that of an earlier demo.')]
    = Path('demo_output'),
    frames: Annotated[int, typer.Option('--frames', min=1, help='Length of the recording.')] = 16,
    seed: Annotated[int, typer.Option('--seed', min=0, help='Another person and room.')] = 3,
    keypoints: Annotated[str, typer.Option(
        '--keypoints', metavar='SOURCE',
        help='depth: the embedded network, as in "pop node". truth: the drawn joints with the '
        'noise, misses and outliers of a good RGB network.')] = 'depth',
) -> None:
    """Synthesise a walk behind a table, play it to the node over DDS, record and show the bodies.

    The first run also generates the pose library and compiles the kernels: a minute or two more.
    """
    from pop_ros.dds_profile import use_large_shared_memory
    from pop_ros.demo import (
        DemoKeypoints,
        draw_frames,
        play_to_node,
        prepare_folder,
        record_scenes,
    )
    from pop_ros.demo_report import error_rows, write_demo_report
    from pop_ros.progress import terminal_progress

    if keypoints not in (known := [kind.value for kind in DemoKeypoints]):
        raise typer.BadParameter(
            f'expected {" or ".join(known)}, found {keypoints}', param_hint='--keypoints')
    chosen = DemoKeypoints(keypoints)
    _keep_to_ourselves()
    use_large_shared_memory()
    paths = prepare_folder(out)
    typer.echo(f'1/4 synthesising {frames} frames')
    with terminal_progress() as display:
        task = display.add_task('frames', total=frames)
        scenes = record_scenes(
            paths, frames, seed, lambda done: display.update(task, completed=done))
    typer.echo('2/4 playing them to the node, recording what it publishes')
    summary = play_to_node(paths, chosen, typer.echo)
    typer.echo(summary.text())
    typer.echo('3/4 drawing')
    with terminal_progress() as display:
        task = display.add_task('pictures', total=frames)
        drawn = draw_frames(paths, scenes, lambda: display.advance(task))
    typer.echo('4/4 writing the report')
    write_demo_report(paths, drawn, summary, chosen)
    for name, count, mean, *_ in error_rows(drawn):
        typer.echo(f'{count} {name} joints: {mean} from the truth in the mean')
    for path in (paths.report, paths.pictures, paths.bodies_bag):
        typer.echo(f'{path.name:12} {path.resolve()}')


def _keep_to_ourselves() -> None:
    """Meet no other node of this machine or network, unless the user chose a domain."""
    os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    os.environ.setdefault('ROS_DOMAIN_ID', str(1 + os.getpid() % 100))
