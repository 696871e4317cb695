"""`pop fit`: RGB-D frames on disk in, one folder of results per frame out."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pop_core.errors import PopError
from pop_ros.file_options import BodyFile, LibraryFile

if TYPE_CHECKING:
    from pop_core.pipeline import BodyPipeline
    from pop_ros.fit_keypoints import FrameKeypoints
    from pop_ros.fit_pictures import FitExplainer
    from pop_ros.frame_folder import FrameFolder

BAD_INPUT = 2


def fit(
    inputs: Annotated[list[Path], typer.Argument(
        metavar='INPUT...',
        help='Folder with color.png, depth.png (16 bit, mm unless camera.json has a '
             'depth_scale) and camera.json (here or in its parent folder), or a folder of such '
             'folders.')],
    out: Annotated[Path, typer.Option('--out', help='Folder for the results.')],
    keypoints: Annotated[list[str] | None, typer.Option(
        '--keypoints', metavar='SOURCE',
        help='json (keypoints.json of each frame), depth (the embedded network, coarse), the path '
             'of an ONNX network, or a name of "pop models list"; several are merged. Without it, '
             'keypoints.json where there is one, depth elsewhere.')] = None,
    decoder: Annotated[str | None, typer.Option(
        '--decoder', metavar='NAME',
        help='How to read a network whose outputs do not tell.')] = None,
    body: BodyFile = None,
    library: LibraryFile = None,
    settings: Annotated[list[str] | None, typer.Option(
        '--set', metavar='NAME=VALUE',
        help='Change a setting, as in docs/parameters.md; may be repeated.')] = None,
    explain: Annotated[bool, typer.Option(
        '--explain', help='Also draw energies over the steps of each fit and, beside a '
        'truth.npz, the errors of the surface.')] = False,
) -> None:
    """Fit the people of RGB-D frames: mesh, joints, mask and uncertainty of each.

    Each frame gets a folder OUT/NAME with one person_K.npz per person, result.json and
    overlay.png. A frame without people is no error.

    An input that cannot be read gets one line, the others are still done, and the exit code is 2.

    One frame, keypoints from a network:

      pop fit five_people --out results --keypoints posenet.onnx

    Two networks merged, the second one looks where the first one finds people:

      pop fit five_people --out results --keypoints rtmo-m --keypoints rtmpose-m

    All frames below a folder, each with its own keypoints.json, two people at most:

      pop fit recordings/ --out results --set max_people=2
    """
    from pop_core.config import PipelineConfig
    from pop_ros.fit_keypoints import FrameKeypoints
    from pop_ros.fit_pictures import FitExplainer
    from pop_ros.progress import first_use_progress
    from pop_ros.settings_flags import with_flags
    from pop_ros.sources import make_pipeline

    config = with_flags(PipelineConfig(), settings or [])
    source = FrameKeypoints(','.join(keypoints or []) or None, decoder, config)
    for reason in source.reasons:
        typer.echo(reason, err=True)
    frames, bad = _collect(inputs)
    if frames:
        with first_use_progress() as progress:
            pipeline = make_pipeline(source, config, body, library, progress)
        explainer = FitExplainer(pipeline) if explain else None
        bad += _fit_all(frames, pipeline, source, out, explainer)
    raise typer.Exit(BAD_INPUT if bad else 0)


def _collect(inputs: Sequence[Path]) -> tuple[list[FrameFolder], int]:
    """Return the frames of all inputs, and how many inputs were refused."""
    from pop_ros.frame_folder import find_frames

    frames: dict[Path, FrameFolder] = {}
    bad = 0
    for path in inputs:
        try:
            found = find_frames(path)
        except (PopError, OSError) as error:
            bad += _complain(error)
            continue
        for folder in found:
            first = frames.setdefault(folder.name, folder)
            if first.path.resolve() != folder.path.resolve():
                bad += _complain(
                    f'{folder.path}: expected a name of its own, found {folder.name}, which is '
                    f'also the name of {first.path}: give it another --out')
    return list(frames.values()), bad


def _fit_all(
    frames: Sequence[FrameFolder], pipeline: BodyPipeline, source: FrameKeypoints, out: Path,
    explainer: FitExplainer | None,
) -> int:
    """Fit and write all frames; return how many could not be."""
    from pop_ros.frame_folder import load_frame
    from pop_ros.progress import terminal_progress
    from pop_ros.result_folder import status_sentence, write_results

    bad = 0
    with terminal_progress() as display:
        for folder in display.track(frames, description='Fitting'):
            try:
                source.choose(folder)
                frame = load_frame(folder.path)
                result = pipeline.process(frame)
                write_results(out / folder.name, frame, result, pipeline.model)
                if explainer is not None:
                    explainer.write(out / folder.name, folder.path, frame, result)
            except (PopError, OSError) as error:
                bad += _complain(error)
                continue
            seconds = sum(result.times_ms.values()) / 1e3
            typer.echo(f'{folder.name}: {status_sentence(result)} ({seconds:.2f} s)')
    return bad


def _complain(error: Exception | str) -> int:
    """Say what was wrong with one input; return 1, to be counted."""
    sys.stderr.write(f'pop fit: {" ".join(str(error).split())}\n')
    return 1
