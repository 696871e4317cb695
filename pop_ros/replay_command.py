"""`pop replay`: a recorded bag in, a bag of bodies out."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pop_ros.file_options import BodyFile, LibraryFile

if TYPE_CHECKING:
    from pop_ros.replay_settings import ReplaySettings

DEFAULT_SOURCES = ['depth']
ENDED_BY_CTRL_C = 130  # as a shell counts it


class Storage(str, Enum):
    """Storages of a rosbag2."""

    MCAP = 'mcap'
    SQLITE3 = 'sqlite3'


def replay(
    bags: Annotated[list[Path], typer.Argument(
        metavar='BAG...', help='A .bag, .db3 or .mcap file, or a rosbag2 folder; several are '
                               'read as one, in order of time.')],
    *,
    out: Annotated[Path, typer.Option('--out', help='New rosbag2 folder for the results.')],
    storage: Annotated[Storage, typer.Option(
        '--storage', help='Storage of that rosbag2. Foxglove reads mcap, and what was written '
                          'of it outlives a crash.')] = Storage.MCAP,
    ros1: Annotated[Path | None, typer.Option(
        '--ros1', help='Also write the results as this ROS 1 bag.')] = None,
    inputs: Annotated[bool, typer.Option(
        '--inputs', help="Copy the camera's messages and the transforms into the results.",
    )] = False,
    keypoints: Annotated[list[str], typer.Option(
        '--keypoints', metavar='SOURCE',
        help='depth (the embedded network, coarse), json (OpenPose files), the path of an ONNX '
             'network, or a name of "pop models list"; several are merged.',
    )] = DEFAULT_SOURCES,
    keypoints_dir: Annotated[Path | None, typer.Option(
        '--keypoints-dir', help='Folder of <stamp_ns>.json files.')] = None,
    decoder: Annotated[str | None, typer.Option(
        '--decoder', help='Decoder of a network whose outputs do not tell.')] = None,
    body: BodyFile = None,
    library: LibraryFile = None,
    settings: Annotated[list[str] | None, typer.Option(
        '--set', metavar='NAME=VALUE',
        help='Change a setting of the pipeline or of the node, as in docs/parameters.md and '
             'docs/ros_api.md; may be repeated.')] = None,
    color: Annotated[str | None, typer.Option('--color', help='Colour topic.')] = None,
    depth: Annotated[str | None, typer.Option('--depth', help='Registered depth topic.')] = None,
    info: Annotated[str | None, typer.Option('--info', help='CameraInfo of colour.')] = None,
    slop: Annotated[float, typer.Option(
        '--slop', min=0.0, max=10.0, help='Largest difference of stamps of a pair (s).')] = 0.03,
    start: Annotated[float, typer.Option(
        '--start', min=0.0, help='Begin this long after the first message (s).')] = 0.0,
    duration: Annotated[float | None, typer.Option(
        '--duration', min=0.0, help='End this long after the start (s).')] = None,
    rate: Annotated[float, typer.Option(
        '--rate', min=0.001, help='Speed at which the node is fed, 1 is as recorded.')] = 1.0,
    loop: Annotated[bool, typer.Option(
        '--loop', help='Play again and again until Ctrl-C, to look at it in rviz; the first '
                       'round is recorded.')] = False,
    step: Annotated[bool, typer.Option(
        '--step', help='Wait for the Enter key before each colour image.')] = False,
    clock: Annotated[bool, typer.Option(
        '--clock', help='Publish the time of the recording on /clock; the node that is started '
                        'uses it.')] = False,
    every_frame: Annotated[bool, typer.Option(
        '--every-frame', help='Fit every frame, without a node and without dropping.')] = False,
    node_running: Annotated[bool, typer.Option(
        '--node-running', help='Feed the node that is running instead of starting one.')] = False,
    pictures: Annotated[Path | None, typer.Option(
        '--pictures', help='Folder for a page with 3D views, and a film, as pop show draws them.',
    )] = None,
    overlays: Annotated[bool, typer.Option(
        '--overlays', help='Also write the picture of every frame there.')] = False,
    rerun: Annotated[Path | None, typer.Option(
        '--rerun', metavar='FILE.rrd', help='Recording for the rerun viewer (extra viz).')] = None,
) -> None:
    """Fit the people of a recording and write mesh, joints and points into a new bag.

    The recording is played to the node over DDS, as a camera would; --every-frame does without
    a node, drops nothing, and gives the same bytes every time.

    Every frame, and what it looks like:

      pop replay recording.bag --out bodies --every-frame --pictures look

    Ten seconds of two bags over and over, for rviz with use_sim_time:

      pop replay a.mcap b.mcap --out bodies --start 60 --duration 10
      --loop --clock

    With your SMPL file, imported once by pop body import, and each frame for itself:

      pop replay recording.bag --out bodies --every-frame --body smpl.npz
      --set tracking.enabled=false

    A damaged bag is replayed as far as it can be read. Exit code 1 says that no frame was fitted.
    """
    from pop_ros.bag_merge import BagPart
    from pop_ros.dds_profile import use_large_shared_memory
    from pop_ros.model_files import ModelFiles
    from pop_ros.node_arguments import SourceArguments
    from pop_ros.replay_pace import Pace
    from pop_ros.replay_session import ReplayRequest, run_replay

    if every_frame and (loop or step or clock or node_running):
        raise typer.BadParameter(
            '--loop, --step, --clock and --node-running play to a node: leave --every-frame away')
    asks_keypoints = keypoints != DEFAULT_SOURCES or keypoints_dir or decoder
    if node_running and (body or library or settings or asks_keypoints):
        raise typer.BadParameter(
            '--keypoints, --body, --library and --set are for the node that is started: give them '
            'to the one that runs (pop node --body FILE, ros2 param set /pop NAME VALUE), or '
            'leave --node-running away')
    if overlays and pictures is None:
        raise typer.BadParameter('--overlays needs a folder: name it with --pictures')
    if rerun is not None:
        from pop_ros.rerun_export import rerun_sdk

        rerun_sdk()  # a missing one is told before the work is done
    chosen = _settings(settings or [], draws=pictures is not None or rerun is not None)
    use_large_shared_memory()
    request = ReplayRequest(
        bags=tuple(bags), out=out, ros1=ros1,
        sources=SourceArguments(','.join(keypoints), keypoints_dir, decoder),
        topics=(color, depth, info), slop_s=slop, every_frame=every_frame,
        node_running=node_running, pace=Pace(rate, loop, step, clock),
        part=BagPart(start, duration), storage=storage.value, inputs=inputs,
        models=ModelFiles(body, library), settings=chosen)
    summary = run_replay(request, typer.echo)
    typer.echo(summary.text())
    typer.echo(f'results: {out}{f" and {ros1}" if ros1 else ""}')
    if summary.interrupted:
        raise typer.Exit(ENDED_BY_CTRL_C)
    if not summary.frames:
        raise typer.Exit(1)
    if pictures is not None or rerun is not None:
        from pop_ros.show_command import draw_replay

        draw_replay(request, pictures, rerun, summary.text().splitlines(), overlays=overlays)


def _settings(flags: Sequence[str], *, draws: bool) -> ReplaySettings:
    """Return the settings that were given; what is to be drawn must be recorded."""
    from pop_ros.replay_settings import ReplaySettings

    settings = ReplaySettings.of_flags(flags)
    mesh = settings.node.mesh
    if draws and (mesh.detail != 'full' or mesh.max_rate_hz):
        raise typer.BadParameter(
            '--pictures and --rerun draw the full mesh of every frame: leave --set mesh.detail '
            'and mesh.max_rate_hz away')
    return settings
