"""`pop synth`: synthetic scenes with truth, as folders that `pop fit` reads, or as recordings."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from pop_core.synthesis.sequence_names import ABOUT, SequenceKind

SHEET_SCENES = 24
KINDS = '; '.join(f'{kind.value}: {about}' for kind, about in ABOUT.items())


class Sensor(str, Enum):
    """Whose depth noise."""

    STRUCTURED_LIGHT = 'structured_light'
    STEREO = 'stereo'
    TIME_OF_FLIGHT = 'time_of_flight'
    PERFECT = 'perfect'


def synth(
    out: Annotated[Path, typer.Option('--out', help='Folder to write into.')],
    count: Annotated[int | None, typer.Option(
        '--count', min=1, help='Number of scenes (12), or of frames of a recording (90).')] = None,
    seed: Annotated[int, typer.Option('--seed', min=0, help='First seed.')] = 0,
    sequence: Annotated[SequenceKind | None, typer.Option(
        '--sequence', metavar='KIND',
        help=f'Write a recording of people who move. {KINDS}.'),
    ] = None,
    rate: Annotated[float, typer.Option(
        '--rate', min=0.1, max=1000.0, help='Frames per second of a recording.')] = 30.0,
    sensor: Annotated[Sensor | None, typer.Option(
        '--sensor', help='Depth noise; without it scenes draw one each, recordings have that of '
        'structured light.')] = None,
    wide: Annotated[bool, typer.Option(
        '--wide', help='Scenes as a detector has to master: also empty and crowded, people as '
        'far as 6 m and cut by the border, cameras from 0.5 to 2.8 m.')] = False,
) -> None:
    """Write synthetic RGB-D frames of occluded people with their truth, and pictures of them.

    Single scenes: one folder each, as pop fit reads it.

      pop synth --count 4 --out frames

      pop fit frames --out results

    A recording: OUT/recording is a rosbag2 as a camera driver writes it,
    the camera's pose on /tf; OUT/keypoints is what a detector would say;
    OUT/truth.npz and OUT/masks are the truth; OUT/film.mp4 shows it all.

      pop synth --sequence crossing --count 150 --out walk

      pop replay walk/recording --keypoints json
      --keypoints-dir walk/keypoints --every-frame --out bodies
    """
    if sequence is None:
        _write_scenes(out, 12 if count is None else count, seed, sensor, wide=wide)
    elif wide:
        raise typer.BadParameter('--wide is for single scenes: leave --sequence away')
    else:
        from pop_ros.synth_sequence_command import write_sequence

        (depth_noise,) = _presets(sensor or Sensor.STRUCTURED_LIGHT) or ('',)
        write_sequence(out, sequence, 90 if count is None else count, seed, rate, depth_noise)


def _presets(sensor: Sensor) -> tuple[str, ...]:
    """Return the sensor as the preset to draw from, none for perfect depth."""
    return () if sensor is Sensor.PERFECT else (sensor.value,)


def _write_scenes(
    out: Path, count: int, seed: int, sensor: Sensor | None, *, wide: bool
) -> None:
    import cv2
    from rich.progress import track

    from pop_core.body.default_body import default_body
    from pop_core.synthesis.contact_sheet import contact_sheet
    from pop_core.synthesis.scene_config import SceneConfig, training_config
    from pop_core.synthesis.scene_files import save_scene
    from pop_core.synthesis.scenes import synthesise_scene

    config = replace(training_config(640, 480), colour=True) if wide else SceneConfig()
    if sensor is not None:
        config = replace(config, sensors=_presets(sensor))
    out.mkdir(parents=True, exist_ok=True)
    kept = []
    step = max(1, count // SHEET_SCENES)
    for k in track(range(count), 'Scenes'):
        scene = synthesise_scene(default_body(), seed + k, config)
        save_scene(scene, out / f'scene_{scene.seed:06d}')
        if k % step == 0:
            kept.append(scene)
    sheet = out / 'contact_sheet.png'
    cv2.imwrite(str(sheet), contact_sheet(kept)[..., ::-1])
    typer.echo(f'{count} scenes in {out}, overview in {sheet}')
