"""`pop body`: what a body model is, how it looks, and the import of SMPL's family."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from pop_core.body.model import BodyModel
    from pop_core.body.model_file import ModelNotes

app = typer.Typer(
    help='Inspect, import and picture body models.', no_args_is_help=True, add_completion=False)

MODEL_HELP = 'Body model made by "pop body import"; without it, the default body.'
ModelArgument = Annotated[
    Path | None, typer.Argument(metavar='[FILE]', help=MODEL_HELP, show_default=False)]


@app.command()
def info(file: ModelArgument = None) -> None:
    """Print what a body model holds and whether it is sound."""
    model, notes, path = _load(file)
    Console().print(_table(model, notes, path))


@app.command('import')
def import_file(
    file: Annotated[Path, typer.Argument(
        metavar='FILE', help='SMPL, SMPL-H, SMPL-X or STAR: .pkl or .npz as published.')],
    out: Annotated[Path, typer.Option('--out', help='npz file to write.')],
    betas: Annotated[int, typer.Option(
        '--betas', min=1, max=300, help='Shape coefficients to keep.')] = 10,
) -> None:
    """Convert your own file of the SMPL family, once; the licence you got it under still holds.

    Pickles are read without running anything they contain.
    """
    from pop_core.body.model_file import ModelNotes, save_body_model
    from pop_core.body.smpl_import import import_body_model

    model = import_body_model(file, betas)
    notes = ModelNotes('as the original file', f'imported from {file.name}')
    save_body_model(_writable(out), model, notes)
    Console().print(_table(model, notes, out))


@app.command()
def show(
    file: ModelArgument = None,
    out: Annotated[Path, typer.Option('--out', help='PNG file to write.')] = Path('body.png'),
) -> None:
    """Write a picture: T-pose, each beta at -2 and +2, posed examples."""
    import cv2

    from pop_core.rendering.body_sheet import draw_body_sheet

    model, _, _ = _load(file)
    sheet = cv2.cvtColor(draw_body_sheet(model), cv2.COLOR_RGB2BGR)
    _writable(out).write_bytes(cv2.imencode('.png', sheet)[1].tobytes())
    typer.echo(f'{out}: {sheet.shape[1]}x{sheet.shape[0]}')


def _load(file: Path | None) -> tuple[BodyModel, ModelNotes, Path]:
    from pop_core.body.default_body import DEFAULT_BODY_FILE
    from pop_core.body.model_file import load_body_model, load_model_notes

    path = file or DEFAULT_BODY_FILE
    return load_body_model(path), load_model_notes(path), path


def _writable(out: Path) -> Path:
    out.parent.mkdir(parents=True, exist_ok=True)
    return out


def _table(model: BodyModel, notes: ModelNotes, path: Path) -> Table:
    import numpy as np

    from pop_core.body.body_facts import mesh_facts, stature_m
    from pop_core.body.joints import N_JOINTS

    mesh = mesh_facts(model.v_template, model.f)
    thin = mesh_facts(model.v_template[model.fit_vertices], model.fit_faces)
    mean, tall, short = (np.zeros(model.n_betas) for _ in range(3))
    tall[0], short[0] = 2.0, -2.0
    low, high = sorted((stature_m(model, short), stature_m(model, tall)))
    rows = {
        'file': f'{path} ({path.stat().st_size / 1e6:.2f} MB)',
        'mesh': f'{mesh.vertices} vertices, {mesh.faces} faces, {_edges(mesh.mean_edge_m)} '
                f'(spread {mesh.edge_spread:.2f})',
        'fitting mesh': f'{thin.vertices} vertices, {thin.faces} faces, '
                        f'{_edges(thin.mean_edge_m)}',
        'joints': str(N_JOINTS),
        'betas': str(model.n_betas),
        'pose offsets': 'none' if model.posedirs is None else f'{model.posedirs.shape[2]}',
        'stature': f'{stature_m(model, mean):.3f} m; {low:.2f} to {high:.2f} m for beta 1 at 2',
        'checks': ', '.join([
            'arrays fit together',
            'closed' if mesh.closed else 'has borders',
            'faces outward' if mesh.volume_m3 > 0 else 'FACES INWARD',
            'fitting mesh closed' if thin.closed else 'fitting mesh has borders',
        ]),
        'licence': notes.licence or 'not stated',
        'provenance': notes.provenance or 'not stated',
    }
    table = Table('property', 'value', title=f'body model "{model.name}"', title_justify='left')
    for name, value in rows.items():
        table.add_row(name, value)
    return table


def _edges(mean_edge_m: float) -> str:
    return f'edges of {1e3 * mean_edge_m:.1f} mm'
