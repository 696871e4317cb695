"""`pop models`: list, fetch and check networks that find keypoints."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from pop_core.errors import PopError
from pop_ros.network_registry import (
    NetworkEntry,
    NetworkFileError,
    find_entry,
    known_entry,
    load_registry,
    networks_folder,
    verified_network,
)
from pop_ros.progress import terminal_progress

BAD_INPUT = 2
app = typer.Typer(
    help='List, fetch and check networks that find keypoints.', no_args_is_help=True,
    add_completion=False)


@app.command('list')
def list_networks(
    urls: Annotated[bool, typer.Option(
        '--urls', help='Also say where each is downloaded from, its SHA-256, and who says so.',
    )] = False,
) -> None:
    """List the networks that can be named after --keypoints, and which of them are here.

    Their weights belong to their publishers: mind the licence.
    """
    table = Table(box=None)
    table.add_column('name', no_wrap=True)  # to be typed after `fetch`
    for title in ('size', 'licence', 'read as', 'here', 'what it is'):
        table.add_column(title, overflow='fold')
    for entry in load_registry():
        size = '?' if entry.size is None else f'{entry.size / 1e6:.0f} MB'
        table.add_row(
            entry.name, size, entry.licence, entry.decoder, _state(entry), entry.about)
    console = Console()
    console.print(table)
    if urls:
        for entry in load_registry():
            sha256 = entry.sha256 or 'not published: give it with --sha256'
            evidence = f', from the {entry.evidence}' if entry.evidence else ''
            console.print(
                f'\n{entry.name}\n  {entry.url}\n  SHA-256 {sha256}{evidence}',
                highlight=False, markup=False, soft_wrap=True)
    console.print(f'\nFetched networks lie in {networks_folder()}.', highlight=False)


@app.command()
def fetch(
    names: Annotated[list[str], typer.Argument(
        metavar='NAME...', help='Names that `pop models list` shows.')],
    sha256: Annotated[str | None, typer.Option(
        '--sha256', metavar='DIGITS', help='SHA-256 of the download, from where you trust; needed '
        'where the publisher tells none.')] = None,
) -> None:
    """Download networks, verify them, and keep those that are what was published.

    An interrupted download goes on where it ended:

      pop models fetch rtmo-m

      pop fit FRAME --out results --keypoints rtmo-m
    """
    entries = [known_entry(name) for name in names]
    if sha256 is not None and len(entries) > 1:
        raise NetworkFileError('--sha256: expected one NAME beside it, found several')
    for entry in entries:
        typer.echo(f'{entry.name} ({entry.licence}) from {entry.url}')
        new = _fetch(entry, sha256)
        typer.echo(f'{entry.name}: {"verified" if new else "is here already"}, {entry.path}')


@app.command()
def check(
    networks: Annotated[list[str] | None, typer.Argument(
        metavar='[NAME|FILE]...', help='Fetched networks, or ONNX files of your own; without any, '
        'all that were fetched.')] = None,
    decoder: Annotated[str | None, typer.Option(
        '--decoder', metavar='NAME', help='How to read a network whose outputs do not '
        'tell.')] = None,
) -> None:
    """Verify networks and try them out in a process of their own, bounded in memory and time.

    Says how the outputs are read and why, and how long an image takes:

      pop models check network.onnx
    """
    wanted = networks or [entry.name for entry in load_registry() if entry.path.exists()]
    if not wanted:
        typer.echo('no network was fetched; `pop models list` shows which there are')
    bad = 0
    for name in wanted:
        try:
            _check(name, decoder)
        except PopError as error:
            sys.stderr.write(f'pop models: {error}\n')
            bad += 1
    raise typer.Exit(BAD_INPUT if bad else 0)


def _fetch(entry: NetworkEntry, sha256: str | None) -> bool:
    """Fetch one network below a bar; return whether it had to be downloaded."""
    from pop_ros.network_fetch import fetch_network

    with terminal_progress() as display:
        task = display.add_task(entry.name, total=entry.size)

        def told(done: int, total: int | None) -> None:
            display.update(task, completed=done, total=total)

        return fetch_network(entry, sha256, told)


def _check(name: str, decoder: str | None) -> None:
    from pop_core.keypoints.onnx_session import read_network
    from pop_ros.network_probe import probe_network

    entry = find_entry(name)
    path = Path(name) if entry is None else entry.path
    content = read_network(path) if entry is None else verified_network(entry)
    digest = hashlib.sha256(content).hexdigest()
    known = entry or next((e for e in load_registry() if e.sha256 == digest), None)
    probe = probe_network(path, decoder or (known.decoder if known else None))
    typer.echo(probe.reason)
    named = '' if known is None else f' ({known.name}, {known.licence})'
    typer.echo(f'{name}: SHA-256 {digest}{named}; {probe.time_ms:.0f} ms per image of 640 x 480')


def _state(entry: NetworkEntry) -> str:
    try:
        verified_network(entry)
    except NetworkFileError:
        if entry.path.exists():
            return 'damaged'
        return 'no' if entry.sha256 else 'no; needs --sha256'
    return 'yes'
