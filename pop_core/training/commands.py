"""`python -m pop_core.training COMMAND`: scenes, train, validate, export, completion."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Annotated

import torch
import typer

from pop_core.errors import PopError
from pop_core.training.completion.commands import app as completion
from pop_core.training.export import export_onnx
from pop_core.training.network import NetworkConfig
from pop_core.training.run import RunConfig, train
from pop_core.training.run import validate as validated
from pop_core.training.scene_writer import SHARD_SCENES, SceneKind, write_shards
from pop_core.training.trainer import (
    CheckpointError,
    TrainConfig,
    Trainer,
    config_of,
    load_network,
    read_checkpoint,
)

BAD_INPUT = 2
SIZES = {
    'small': NetworkConfig(),
    'large': NetworkConfig(
        widths=(24, 48, 80, 128, 176), blocks=(1, 2, 2, 1), pyramid=80, focal_px=224.0),
    'close': NetworkConfig(shown_at_m=2.0),
}
IMAGES = {'small': (192, 160), 'large': (288, 224), 'close': (128, 160)}
app = typer.Typer(add_completion=False, no_args_is_help=True, rich_markup_mode=None)
app.add_typer(completion, name='completion')

Size = Annotated[str, typer.Option('--size', help=f'One of {", ".join(SIZES)}.')]
Mocap = Annotated[Path | None, typer.Option(
    '--mocap', help='Captured poses, .npz with pose (n, 24, 3), to be drawn as well.')]


@app.command()
def scenes(
    out: Annotated[Path, typer.Option('--out', help='Folder of packed scenes.')],
    count: Annotated[int, typer.Option('--count', min=1, help='Number of scenes.')] = 25_000,
    seed: Annotated[int, typer.Option('--seed', min=1, help='Decides the scenes.')] = 1,
    size: Size = 'small',
    workers: Annotated[int, typer.Option('--workers', min=1, help='Processes.')] = 1,
    mocap: Mocap = None,
) -> None:
    """Draw training scenes into packed files; files that are there already are kept.

    A scene takes 110 kB, of --size close (each person from near, for the second network) 76 kB.
    Another --seed gives validation scenes.
    """
    network, begin, before = _network(size), time.monotonic(), None
    for done in write_shards(
            out, count, seed=seed, workers=workers, kind=SceneKind(
                IMAGES[size], network.focal_px, network.shown_at_m, mocap)):
        before = done - SHARD_SCENES if before is None else before
        rate = (done - before) / (time.monotonic() - begin)
        typer.echo(f'{done} of {count} scenes in {out}, {rate:.0f}/s')


@app.command(name='train')
def train_command(
    out: Annotated[Path, typer.Option('--out', help='Folder of the run; goes on if it exists.')],
    minutes: Annotated[float, typer.Option('--minutes', min=0.0, help='Length of this run.')],
    scenes: Annotated[Path | None, typer.Option(
        '--scenes', help='Packed scenes to begin with.')] = None,
    validation: Annotated[Path | None, typer.Option(
        '--validation', help='Packed scenes of another seed, to draw the curves from.')] = None,
    size: Size = 'small',
    device: Annotated[str, typer.Option('--device', help='cpu, cuda, or auto.')] = 'auto',
    workers: Annotated[int, typer.Option(
        '--workers', min=0, help='Processes that draw fresh scenes meanwhile.')] = 0,
    mocap: Mocap = None,
    batch: Annotated[int, typer.Option('--batch', min=2, help='Images per step.')] = 32,
    rate: Annotated[float, typer.Option(
        '--rate', help='Largest learning rate of AdamW.')] = TrainConfig().rate,
    matrix_rate: Annotated[float, typer.Option(
        '--matrix-rate', help='Largest learning rate of Muon.')] = TrainConfig().matrix_rate,
    cooldown: Annotated[float, typer.Option(
        '--cooldown', min=0.0, max=1.0,
        help='Share of this run in which the rate falls to nothing: for the last run.')] = 0.0,
    threads: Annotated[int, typer.Option('--threads', min=1, help='Threads on a CPU.')] = 1,
    weights: Annotated[Path | None, typer.Option(
        '--weights', help='Begin a new run with the weights.pt of another one.')] = None,
) -> None:
    """Train for some minutes; run it again to go on.

    Every four minutes, and at the end, OUT gets checkpoint.pt (to go on), weights.pt (the averaged
    weights, a few MB, to go on elsewhere or to export), history.json and curves.png.

    A GPU for 9 minutes, scenes drawn meanwhile on 14 cores:

      python -m pop_core.training train --out run --minutes 9 --size large --batch 256 --workers 14
    """
    torch.set_num_threads(threads)
    chosen = device if device != 'auto' else 'cuda' if torch.cuda.is_available() else 'cpu'
    config = TrainConfig(batch=batch, rate=rate, matrix_rate=matrix_rate)
    trainer = Trainer(torch.device(chosen), _network(size), config)
    if weights is not None and not (out / 'checkpoint.pt').exists():
        trainer.load(weights)
    run = RunConfig(
        out=out, minutes=minutes, size=IMAGES[size], scenes=scenes, validation=validation,
        workers=workers or (0 if scenes else 1), mocap=mocap, cooldown=cooldown)
    train(trainer, run, _say)


@app.command()
def validate(
    checkpoint: Annotated[Path, typer.Argument(help='Checkpoint or weights.')],
    validation: Annotated[Path, typer.Option('--validation', help='Packed scenes.')],
) -> None:
    """Print the figures of a network, cell by cell, with people told apart by truth."""
    config = config_of(read_checkpoint(checkpoint), checkpoint)
    trainer = Trainer(torch.device('cpu'), config)
    trainer.load(checkpoint)
    name = next((name for name, known in SIZES.items() if known == config), None)
    if name is None:
        raise CheckpointError(
            f'{checkpoint}: expected a network of --size {", ".join(SIZES)}, found {config}')
    run = RunConfig(
        out=checkpoint.parent, minutes=0.0, size=IMAGES[name], validation=validation)
    for name, value in validated(trainer, run).items():
        typer.echo(f'{name:12} {value:.4f}')


@app.command()
def export(
    checkpoint: Annotated[Path, typer.Argument(help='Checkpoint or weights.')],
    out: Annotated[Path, typer.Option('--out', help='The .onnx file.')],
    weights: Annotated[Path | None, typer.Option(
        '--weights', help='Also write the averaged weights in half precision here.')] = None,
) -> None:
    """Write the averaged network as ONNX."""
    state = read_checkpoint(checkpoint)
    export_onnx(load_network(checkpoint), out, f'after {state["images"]} images')
    if weights is not None:
        trainer = Trainer(torch.device('cpu'), config_of(state, checkpoint))
        trainer.load(checkpoint)
        trainer.save_weights(weights)
    typer.echo(f'{out}: {out.stat().st_size / 1e6:.1f} MB')


def _network(size: str) -> NetworkConfig:
    if size not in SIZES:
        raise typer.BadParameter(f'expected one of {", ".join(SIZES)}, found {size}')
    return SIZES[size]


def _say(line: str) -> None:
    sys.stdout.write(line + '\n')
    sys.stdout.flush()


def main() -> int:
    """Run a command; errors of the package become one line and exit code 2."""
    try:
        app()
    except PopError as error:
        sys.stderr.write(f'pop_core.training: {" ".join(str(error).split())}\n')
        return BAD_INPUT
    return 0
