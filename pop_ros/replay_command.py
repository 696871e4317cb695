"""`pop replay`: a recorded bag in, a bag of bodies out."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

NodeRunning = Annotated[bool, typer.Option(
    '--node-running', help='Feed the node that is running instead of starting one.')]


def replay(
    bag: Annotated[Path, typer.Argument(help='A .bag, .db3 or .mcap file, or a rosbag2 folder.')],
    *,
    out: Annotated[Path, typer.Option('--out', help='New rosbag2 folder for the results.')],
    ros1: Annotated[Path | None, typer.Option(
        '--ros1', help='Also write the results as this ROS 1 bag.')] = None,
    keypoints: Annotated[str, typer.Option(
        '--keypoints', help='json (OpenPose files) or the path of an ONNX network; depth, the '
                            'embedded network, is not in this version.')] = 'depth',
    keypoints_dir: Annotated[Path | None, typer.Option(
        '--keypoints-dir', help='Folder of <stamp_ns>.json files.')] = None,
    decoder: Annotated[str | None, typer.Option(
        '--decoder', help='Decoder of a network whose outputs do not tell.')] = None,
    color: Annotated[str | None, typer.Option('--color', help='Colour topic.')] = None,
    depth: Annotated[str | None, typer.Option('--depth', help='Registered depth topic.')] = None,
    info: Annotated[str | None, typer.Option('--info', help='CameraInfo of colour.')] = None,
    slop: Annotated[float, typer.Option(
        '--slop', min=0.0, max=10.0, help='Largest difference of stamps of a pair (s).')] = 0.03,
    rate: Annotated[float, typer.Option(
        '--rate', min=0.001, help='Speed at which the node is fed, 1 is as recorded.')] = 1.0,
    every_frame: Annotated[bool, typer.Option(
        '--every-frame', help='Fit every frame, without a node and without dropping.')] = False,
    node_running: NodeRunning = False,
    pictures: Annotated[Path | None, typer.Option(
        '--pictures', help='Folder for a page with 3D views, and a film, as pop show draws them.',
    )] = None,
    rerun: Annotated[Path | None, typer.Option(
        '--rerun', metavar='FILE.rrd', help='Recording for the rerun viewer (extra viz).')] = None,
) -> None:
    """Fit the people of a recorded bag and write mesh, joints and points into a new bag."""
    from pop_core.errors import PopError
    from pop_ros.dds_profile import use_large_shared_memory
    from pop_ros.node_arguments import SourceArguments
    from pop_ros.replay_session import ReplayRequest, run_replay

    use_large_shared_memory()
    request = ReplayRequest(
        bag=bag, out=out, ros1=ros1, sources=SourceArguments(keypoints, keypoints_dir, decoder),
        topics=(color, depth, info), slop_s=slop, rate=rate, every_frame=every_frame,
        node_running=node_running)
    try:
        summary = run_replay(request, typer.echo)
    except PopError as error:
        typer.echo(f'pop replay: {error}', err=True)
        raise typer.Exit(2) from error
    typer.echo(summary.text())
    typer.echo(f'results: {out}{f" and {ros1}" if ros1 else ""}')
    if not summary.frames:
        raise typer.Exit(1)
    if pictures is not None or rerun is not None:
        from pop_ros.show_command import draw_replay

        draw_replay(request, pictures, rerun, summary.text().splitlines())
