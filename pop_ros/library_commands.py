"""`pop library`: build, merge, inspect, picture and query pose libraries."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from pop_core.errors import LibraryFileError
from pop_ros.progress import terminal_progress

if TYPE_CHECKING:
    from pop_core.retrieval.library_builder import BuildReport, PoseSource
    from pop_core.retrieval.pose_library import PoseLibrary

app = typer.Typer(
    help='Build, merge, inspect, picture and query pose libraries.', no_args_is_help=True,
    add_completion=False)

LIBRARY_HELP = 'Library file; without it, the default library, generated on first use.'
LibraryArgument = Annotated[
    Path | None, typer.Argument(metavar='[FILE]', help=LIBRARY_HELP, show_default=False)]
FAILURES_SHOWN = 20


@app.command()
def build(
    out: Annotated[Path, typer.Argument(metavar='OUT', help='Library file to write.')],
    surreal: Annotated[list[Path] | None, typer.Option(
        help='Folder with SURREAL clips (*_info.mat); with *_depth.mat and *_segm.mat beside '
        'them, visibility is computed.', show_default=False)] = None,
    amass: Annotated[list[Path] | None, typer.Option(
        help='Folder with AMASS files (*.npz, z up).', show_default=False)] = None,
    bvh: Annotated[list[Path] | None, typer.Option(
        help='Folder with BVH files (y up).', show_default=False)] = None,
    npz: Annotated[list[Path] | None, typer.Option(
        help='Folder with npz files of SMPL poses.', show_default=False)] = None,
    every: Annotated[int, typer.Option(min=1, help='Take every n-th frame.')] = 1,
    spacing: Annotated[float, typer.Option(
        min=0.0, max=0.5, help='Leave out poses nearer than this (m) to a kept one; 0 keeps '
        'all.')] = 0.02,
    mirror: Annotated[bool, typer.Option(help='Add mirror images.')] = True,
    jobs: Annotated[int, typer.Option(min=1, max=256, help='Processes.')] = 2,
    ray: Annotated[str, typer.Option(
        metavar='ADDRESS', help='Convert on a Ray cluster ("local" starts one here).')] = '',
) -> None:
    """Build a library from your own files; interrupted, the same command goes on."""
    from pop_core.body.default_body import default_body
    from pop_core.retrieval.build_workers import ProcessRunner, RayRunner
    from pop_core.retrieval.library_builder import BuildOptions, build_from_files

    folders = {'surreal': surreal, 'amass': amass, 'bvh': bvh, 'npz': npz}
    sources = _sources(folders)
    runner = RayRunner(ray) if ray else ProcessRunner(jobs)
    with counted(f'Reading {len(sources)} files') as progress:
        report = build_from_files(
            out, sources, BuildOptions(every, mirror, spacing), default_body(), runner=runner,
            progress=progress)
    _print_report(report, out)


@app.command()
def merge(
    out: Annotated[Path, typer.Argument(metavar='OUT', help='Library file to write.')],
    files: Annotated[list[Path], typer.Argument(metavar='FILES...', help='Libraries.')],
    spacing: Annotated[float, typer.Option(
        min=0.0, max=0.5, help='Leave out poses nearer than this (m) to a kept one.')] = 0.0,
) -> None:
    """Join libraries into one."""
    from pop_core.retrieval.library_merge import merge_libraries

    kept = merge_libraries(out, files, spacing)
    Console().print(f'{out}: {kept:,} poses of {len(files)} libraries')


@app.command()
def info(file: LibraryArgument = None) -> None:
    """Print what a library holds, and check it."""
    from pop_core.retrieval.default_library import default_library_path
    from pop_core.retrieval.library_file import load_library, read_header

    load(file)
    path = file or default_library_path()
    header = read_header(path)
    library = load_library(path, verify=True)
    table = Table(show_header=False, box=None)
    rows = {
        'file': str(path), 'poses': f'{header.poses:,}',
        'size': f'{path.stat().st_size / 1e6:.1f} MB', 'checksum': f'{header.checksum:08x}, good',
        **header.notes, **_content(library),
    }
    for name, value in rows.items():
        table.add_row(name, value)
    Console().print(table)


@app.command()
def sample(
    file: LibraryArgument = None,
    count: Annotated[int, typer.Option(min=1, max=2000, help='Poses to show.')] = 100,
    seed: Annotated[int, typer.Option(help='Decides which.')] = 0,
    out: Annotated[Path, typer.Option(help='PNG file to write.')] = Path('poses.png'),
) -> None:
    """Write a contact sheet of random poses."""
    import cv2
    import numpy as np

    from pop_core.body.default_body import default_body
    from pop_core.retrieval.contact_sheet import contact_sheet

    library = load(file)
    count = min(count, len(library))
    chosen = np.random.default_rng(seed).choice(len(library), count, replace=False)
    picture = contact_sheet(library, chosen.tolist(), default_body())
    if not cv2.imwrite(str(out), picture[:, :, ::-1]):
        raise LibraryFileError(f'{out}: expected a PNG file in a folder that exists')
    Console().print(f'{out}: {count} of {len(library):,} poses')


@app.command()
def query(
    file: LibraryArgument = None,
    pose: Annotated[int, typer.Option(min=0, help='Row of the library to ask for.')] = 0,
    joints: Annotated[Path | None, typer.Option(
        help='JSON file with 15 rows (x, y, z) in metres, camera frame, null for hidden joints; '
        'asks for them instead.', show_default=False)] = None,
    hide: Annotated[str, typer.Option(
        metavar='NAMES', help='Joints to hide, such as left_elbow,left_wrist.')] = '',
    candidates: Annotated[int, typer.Option(min=1, max=64, help='Answers.')] = 6,
    same_visibility: Annotated[bool, typer.Option(
        '--same-visibility', help='Only poses recorded with the same visible joints (the '
        "paper's rule).")] = False,
    out: Annotated[Path | None, typer.Option(
        help='PNG file for a picture of the answers.', show_default=False)] = None,
) -> None:
    """Find the poses that explain joints, some of them hidden, and say how long it took."""
    from pop_core.retrieval.retrieve import RetrievalConfig
    from pop_ros.library_query import answer, lifted_from_file, lifted_from_pose

    library = load(file)
    config = RetrievalConfig(candidates=candidates, same_visibility=same_visibility)
    names = [name for name in hide.split(',') if name]
    lifted = lifted_from_file(joints, names) if joints else lifted_from_pose(library, pose, names)
    answer(library, lifted, config, out)


@contextmanager
def counted(title: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar of things done on the terminal."""
    with terminal_progress() as display:
        task = display.add_task(title, total=None)
        yield lambda done, total: display.update(task, completed=done, total=total)


def load(file: Path | None) -> PoseLibrary:
    """Return a library of a file, or the default one."""
    from pop_core.retrieval.default_library import default_library
    from pop_core.retrieval.library_file import load_library

    if file is not None:
        return load_library(file)
    with counted('Generating the default pose library') as progress:
        return default_library(progress)


def _sources(folders: dict[str, list[Path] | None]) -> list[PoseSource]:
    from pop_core.retrieval.library_builder import find_sources

    sources = [
        source for kind, places in folders.items() for place in places or ()
        for source in find_sources(kind, place)
    ]
    if not sources:
        raise LibraryFileError('expected one of --surreal, --amass, --bvh, --npz, found none')
    return sources


def _print_report(report: BuildReport, out: Path) -> None:
    console = Console()
    for line in report.failures[:FAILURES_SHOWN]:
        console.print(f'left out: {line}', markup=False, highlight=False)
    if len(report.failures) > FAILURES_SHOWN:
        console.print(f'... and {len(report.failures) - FAILURES_SHOWN} more')
    console.print(
        f'{out}: {report.poses_kept:,} poses kept of {report.poses_read:,} read from '
        f'{report.files - len(report.failures)} files; {len(report.failures)} left out')


def _content(library: PoseLibrary) -> dict[str, str]:
    import numpy as np

    from pop_core.body.joints import SHARED_INDEX
    from pop_core.retrieval.pose_library import ALL_VISIBLE

    step = max(1, len(library) // 100_000)
    joints = library.joints[::step]
    rise = joints[:, SHARED_INDEX['neck'], 1]
    knees = joints[:, [SHARED_INDEX['left_knee'], SHARED_INDEX['right_knee']], 1]
    upright = rise > 0.35
    sitting = upright & (knees.max(axis=1) > -0.2)
    partly = float(np.mean(np.asarray(library.masks[::step]) != ALL_VISIBLE))
    return {
        'trunk upright': f'{upright.mean():.0%}', 'thighs raised': f'{sitting.mean():.0%}',
        'recorded partly hidden': f'{partly:.0%}',
    }
