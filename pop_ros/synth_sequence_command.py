"""What `pop synth --sequence` writes: a recording, its keypoints, its truth, a film."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import typer
from rich.progress import track

from pop_core.body.default_body import default_body
from pop_core.rendering.summary_film import SummaryFilm
from pop_core.synthesis.contact_sheet import contact_sheet, scene_tile
from pop_core.synthesis.scenes import SyntheticScene
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.synthesis.sequence_files import SequenceFolder, T_map_camera
from pop_core.synthesis.sequence_names import SequenceKind
from pop_ros.bag_reader import BagError
from pop_ros.frame_bag import FrameBag

SHEET_FRAMES = 18


def write_sequence(
    out: Path, kind: SequenceKind, count: int, seed: int, rate_hz: float, sensor: str
) -> None:
    """Write a recording into a new folder; all of it is made frame by frame.

    Raises:
        BagError: If there is a recording already.
    """
    recording = out / 'recording'
    if recording.exists():
        raise BagError(f'{recording}: expected a new recording to write, found one there already')
    config = SequenceConfig(kind, count, rate_hz, sensor)
    kept: list[SyntheticScene] = []
    step = max(1, count // SHEET_FRAMES)
    files = SequenceFolder(out)
    with FrameBag(recording) as bag, SummaryFilm(out / 'film.mp4', rate_hz) as film:
        frames = film_sequence(default_body(), seed, config)
        for number, frame in enumerate(track(frames, f'{kind.value}', total=count)):
            bag.add(frame.scene.frame, T_map_camera(frame))
            files.add(frame)
            film.add(scene_tile(frame.scene))
            if number % step == 0 and len(kept) < SHEET_FRAMES:
                kept.append(frame.scene)
    files.close()
    cv2.imwrite(str(out / 'contact_sheet.png'), np.ascontiguousarray(
        contact_sheet(kept)[..., ::-1]))
    typer.echo(
        f'{count} frames ({count / rate_hz:.1f} s) in {recording}, what a detector says of them '
        f'in {files.keypoints}, the truth in {files.truth} and {files.masks}, a film in '
        f'{out / "film.mp4"}')
    typer.echo(
        f'next: pop replay {recording} --keypoints json --keypoints-dir {files.keypoints} '
        f'--every-frame --out {out / "bodies"}')
