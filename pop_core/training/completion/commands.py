"""`python -m pop_core.training completion COMMAND`: views, train, validate, export."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import torch
import typer

from pop_core.training.completion.export import export_onnx
from pop_core.training.completion.trainer import CompletionTrainer, train
from pop_core.training.completion.validation import error_table
from pop_core.training.completion.view_pool import load_pool
from pop_core.training.completion.views import write_views

app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None,
    help='The network that says where all joints of a person are, from depth and keypoints.')


@app.command()
def views(
    out: Annotated[Path, typer.Option('--out', help='Folder of packed views.')],
    count: Annotated[int, typer.Option('--count', min=1, help='Number of views.')] = 320_000,
    seed: Annotated[int, typer.Option('--seed', min=1, help='Decides the views.')] = 1,
    workers: Annotated[int, typer.Option('--workers', min=1, help='Processes.')] = 1,
    mocap: Annotated[Path | None, typer.Option(
        '--mocap', help='Captured poses, .npz with pose (n, 24, 3), to be drawn as well.')] = None,
) -> None:
    """Draw views of people into packed files, 7 kB each; files that are there are kept.

    Another --seed gives validation views.
    """
    begin = time.monotonic()
    for done in write_views(out, count, seed=seed, workers=workers, mocap=mocap):
        typer.echo(f'{done} of {count} views in {out}, after {time.monotonic() - begin:.0f} s')


@app.command(name='train')
def train_command(
    out: Annotated[Path, typer.Option('--out', help='The checkpoint; goes on if it exists.')],
    views: Annotated[Path, typer.Option('--views', help='Packed views.')],
    minutes: Annotated[float, typer.Option('--minutes', min=0.0, help='Length of this run.')],
    validation: Annotated[Path | None, typer.Option(
        '--validation', help='Packed views of another seed.')] = None,
    threads: Annotated[int, typer.Option('--threads', min=1, help='Threads.')] = 2,
) -> None:
    """Train on the CPU for some minutes, in whose second half the learning rate falls."""
    torch.set_num_threads(threads)
    trainer = CompletionTrainer()
    if out.exists():
        trainer.load(out)
        typer.echo(f'going on after {trainer.views} views')
    train(trainer, views, validation, out, minutes, typer.echo)


@app.command()
def validate(
    checkpoint: Annotated[Path, typer.Argument(help='What train wrote.')],
    views: Annotated[Path, typer.Option('--views', help='Packed views of another seed.')],
) -> None:
    """Print how far off joints are, by how many of a person's joints are seen."""
    trainer = CompletionTrainer()
    trainer.load(checkpoint)
    typer.echo(f'after {trainer.views} views')
    for line in error_table(trainer.averaged, load_pool(views)):
        typer.echo(line)


@app.command()
def export(
    checkpoint: Annotated[Path, typer.Argument(help='What train wrote.')],
    out: Annotated[Path, typer.Option('--out', help='The .onnx file.')],
) -> None:
    """Write the averaged network as ONNX."""
    trainer = CompletionTrainer()
    trainer.load(checkpoint)
    export_onnx(trainer.averaged, out, f'after {trainer.views} views')
    typer.echo(f'{out}: {out.stat().st_size / 1e6:.1f} MB')
