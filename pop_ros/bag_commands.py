"""`pop bag make`: RGB-D frames on disk as a bag."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

# Frames in a folder are rarely all that a camera took; so far apart, each is looked at anew.
FRAME_RATE_HZ = 5.0

app = typer.Typer(no_args_is_help=True, help='Make bags.')


@app.callback()
def bag() -> None:
    """Make bags."""


@app.command()
def make(
    folder: Annotated[Path, typer.Argument(
        help='A frame folder (color.png, depth.png, camera.json), or one with such folders.')],
    *,
    out: Annotated[Path, typer.Option('--out', help='New rosbag2 folder.')],
    rate: Annotated[float, typer.Option(
        '--rate', min=0.001, max=1000.0,
        help='Frames per second, as they were taken: people are followed from frame to frame. '
             'Scenes that have nothing to do with each other: 0.2.')] = FRAME_RATE_HZ,
    frame_id: Annotated[str, typer.Option(
        '--frame-id', help='Frame of the colour camera.')] = 'camera_color_optical_frame',
    keypoints_dir: Annotated[Path | None, typer.Option(
        '--keypoints-dir',
        help='Copy keypoints.json of the frames here, named by stamp, for pop replay.')] = None,
) -> None:
    """Write RGB-D frames as a rosbag2 with CameraInfo, as a camera driver would have.

    The twelve frames of a folder, to be played like any recording:

      pop bag make frames/ --out recording
      pop replay recording --out bodies --every-frame
    """
    from pop_ros.bag_make import make_bag
    from pop_ros.progress import terminal_progress

    with terminal_progress() as display:
        task = display.add_task('Frames', total=None)
        made = make_bag(
            folder, out, rate_hz=rate, frame_id=frame_id, keypoints_dir=keypoints_dir,
            on_frame=lambda done, total: display.update(task, completed=done, total=total))
    for sentence in made.refused or []:
        typer.echo(f'pop bag make: left out: {" ".join(sentence.split())}', err=True)
    assert made.topics is not None
    typer.echo(f'{made.frames} frames in {out}')
    for topic in made.topics.all:
        typer.echo(f'  {topic}')
    if keypoints_dir is not None:
        typer.echo(f'{made.keypoints} keypoint files in {keypoints_dir}')
    if made.refused:
        raise typer.Exit(2)
