"""`pop synth`: synthetic scenes with truth, as folders that `pop fit` reads."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from pop_core.synthesis.scenes import SyntheticScene

SHEET_SCENES = 24


def synth(
    out: Annotated[Path, typer.Option('--out', help='Folder to write the scenes into.')],
    count: Annotated[int, typer.Option('--count', min=1, help='Number of scenes.')] = 12,
    seed: Annotated[int, typer.Option('--seed', min=0, help='First seed.')] = 0,
    sequence: Annotated[
        bool, typer.Option('--sequence', help='One person walking, instead of single scenes.'),
    ] = False,
) -> None:
    """Write synthetic RGB-D scenes of occluded people, their truth and a contact sheet."""
    import cv2
    from rich.progress import track

    from pop_core.synthesis.contact_sheet import contact_sheet
    from pop_core.synthesis.scene_files import save_scene

    out.mkdir(parents=True, exist_ok=True)
    kept = []
    step = max(1, count // SHEET_SCENES)
    for k, scene in enumerate(track(_scenes(count, seed, sequence), 'Scenes', total=count)):
        name = f'frame_{k:04d}' if sequence else f'scene_{scene.seed:06d}'
        save_scene(scene, out / name)
        if k % step == 0:
            kept.append(scene)
    sheet = out / 'contact_sheet.png'
    cv2.imwrite(str(sheet), contact_sheet(kept)[..., ::-1])
    typer.echo(f'{count} scenes in {out}, overview in {sheet}')


def _scenes(count: int, seed: int, sequence: bool) -> Iterable[SyntheticScene]:
    """Return scenes one by one: a sequence at once, since its frames belong together."""
    from pop_core.body.default_body import default_body
    from pop_core.synthesis.scenes import synthesise_scene
    from pop_core.synthesis.sequence import synthesise_sequence

    model = default_body()
    if sequence:
        return synthesise_sequence(model, seed, count)
    return (synthesise_scene(model, seed + k) for k in range(count))
