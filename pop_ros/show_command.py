"""`pop show`: a recording and its bodies as a page and a film."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from pop_core.body.model import BodyModel
    from pop_ros.replay_session import ReplayRequest
    from pop_ros.show_recording import ShowRequest


def show(
    recording: Annotated[list[Path], typer.Argument(
        metavar='RECORDING...', help='Bag of the camera; several are read as one.')],
    bodies: Annotated[Path, typer.Argument(help='Bag that pop replay made of it.')],
    *,
    out: Annotated[Path | None, typer.Option(
        '--out', help='Folder for report.html and the film.')] = None,
    rerun: Annotated[Path | None, typer.Option(
        '--rerun', metavar='FILE.rrd', help='Recording for the rerun viewer (extra viz).')] = None,
    overlays: Annotated[bool, typer.Option(
        '--overlays', help='Also write the picture of every frame, OUT/overlays/<stamp_ns>.png.',
    )] = False,
    film: Annotated[str, typer.Option(
        '--film', help='Name of the film: .mp4, .webp or .gif.')] = 'film.mp4',
    body: Annotated[Path | None, typer.Option(
        '--body', metavar='FILE',
        help='Body model that was fitted (--body of the replay), if not the default one.')] = None,
    color: Annotated[str | None, typer.Option('--color', help='Colour topic.')] = None,
    depth: Annotated[str | None, typer.Option('--depth', help='Registered depth topic.')] = None,
    info: Annotated[str | None, typer.Option('--info', help='CameraInfo of colour.')] = None,
    slop: Annotated[float, typer.Option(
        '--slop', min=0.0, max=10.0, help='Largest difference of stamps of a pair (s).')] = 0.5,
) -> None:
    """Draw recorded bodies over their recording: a page with 3D views, a film, or for rerun.

      pop show recording.bag bodies --out look

    writes look/report.html, which needs no network, and look/film.mp4. Bodies that were recorded
    with --inputs are a recording as well:

      pop show bodies bodies --out look --overlays
    """
    from pop_ros.model_files import ModelFiles
    from pop_ros.show_recording import ShowRequest

    if out is None and rerun is None:
        raise typer.BadParameter('expected --out, --rerun or both, found neither')
    _draw(ModelFiles(body).load_body(), rerun, out, ShowRequest(
        recordings=tuple(recording), bodies=bodies, out=out or Path(), topics=(color, depth, info),
        slop_s=slop, film=film, overlays=overlays))


def draw_replay(
    replayed: ReplayRequest, out: Path | None, rerun: Path | None, notes: Sequence[str],
    *, overlays: bool,
) -> None:
    """Draw what a replay has just recorded, with what it said."""
    from pop_ros.show_recording import ShowRequest

    _draw(replayed.models.load_body(), rerun, out, ShowRequest(
        recordings=replayed.bags, bodies=replayed.out, out=out or Path(), topics=replayed.topics,
        slop_s=replayed.slop_s, notes=notes, overlays=overlays))


def _draw(
    model: BodyModel, rerun: Path | None, out: Path | None, request: ShowRequest
) -> None:
    """Write what was asked for."""
    if rerun is not None:
        from pop_ros.rerun_export import write_rerun
        from pop_ros.show_recording import read_scenes

        frames = write_rerun(read_scenes(request, model), model.f, rerun)
        typer.echo(f'{rerun}: {frames} frames')
    if out is not None:
        _draw_page(model, request)


def _draw_page(model: BodyModel, request: ShowRequest) -> None:
    from pop_ros.progress import terminal_progress
    from pop_ros.show_recording import show_recording

    with terminal_progress() as display:
        task = display.add_task('Drawing', total=None)
        written = show_recording(
            request, model, lambda frames: display.update(task, completed=frames))
    for path in written:
        typer.echo(f'{path}')
