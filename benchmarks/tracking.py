"""People over time on synthetic recordings: the tracker beside every frame fitted alone.

    python -m benchmarks tracking --frames 120 --json tracking.json --chart tracking.png

Errors are compared on the people and frames that all methods have found; who is found at all and
keeps the number is told by MOTA, IDF1 and switches. Finished sequences are kept under a key of
settings, code and data: an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import json
from itertools import islice
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmarks.accuracy import make_console
from benchmarks.accuracy_cache import cache_folder, run_key
from benchmarks.accuracy_methods import GivenDetections
from benchmarks.arguments import positive
from benchmarks.tracking_methods import METHODS, follow, make_methods
from benchmarks.tracking_pictures import draw_chart
from benchmarks.tracking_records import load_tables, save_tables
from benchmarks.tracking_summary import (
    FollowedSequence,
    by_kind,
    comparison,
    kind_table,
    summarise,
    with_rows,
)
from pop_core.body.default_body import default_body
from pop_core.config import PipelineConfig
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.synthesis.sensor_noise import SENSORS
from pop_core.synthesis.sequence import SequenceConfig, film_sequence
from pop_core.synthesis.sequence_names import SequenceKind
from pop_core.tracking.tracking_config import TrackingConfig
from pop_ros.settings_flags import with_flags

FIRST_SEED = 20_000  # far from the seeds of tests, training and single scenes
WARM_FRAMES = 3


def run(argv: list[str]) -> int:
    """Measure, print the tables, write JSON and chart when asked to."""
    options = parse(argv)
    console = make_console()
    console.print('Loading the pose library ...')
    sequences = measure(options, console)
    names = list(sequences[0].tracks)
    summaries = {name: summarise(sequences, name) for name in names}
    kinds = {name: by_kind(sequences, name) for name in names}
    console.print(comparison(summaries))
    console.print(kind_table(kinds))
    for name, summary in summaries.items():
        alone = summary['alone_m']
        if alone['n']:
            console.print(
                f'{name}: also gives out bodies that another method does not, or of people '
                f'hardly seen: {alone["n"] // 14}, joints {1000 * alone["mean"]:.0f} mm off')
    if options.json is not None:
        report = {'options': vars(options) | {'json': str(options.json)}, 'methods': summaries,
                  'kinds': kinds}
        options.json.write_text(json.dumps(report, indent=1, default=str), encoding='utf-8')
    if options.chart is not None:
        draw_chart(options.chart, summaries)
    return 0


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        prog='python -m benchmarks tracking', description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = [kind.value for kind in SequenceKind]
    parser.add_argument('--frames', type=positive, default=120, help='frames of each sequence')
    parser.add_argument('--rate', type=float, default=30.0, help='frames per second')
    parser.add_argument(
        '--kinds', nargs='+', choices=kinds, default=kinds, metavar='KIND',
        help=f'of {", ".join(kinds)}')
    parser.add_argument('--seeds', type=positive, default=1, help='sequences of each kind')
    parser.add_argument('--seed', type=int, default=FIRST_SEED, help='seed of the first')
    parser.add_argument(
        '--sensor', choices=sorted(SENSORS), default='structured_light', help='depth noise')
    parser.add_argument(
        '--methods', nargs='+', choices=list(METHODS), default=list(METHODS), metavar='METHOD',
        help=f'of {", ".join(repr(name) for name in METHODS)}')
    parser.add_argument('--json', type=Path, help='file to write all figures into')
    parser.add_argument('--chart', type=Path, help='picture of errors over time since last seen')
    parser.add_argument(
        '--set', action='append', default=[], metavar='NAME=VALUE', help='change a setting')
    return parser.parse_args(argv)


def configs(pairs: list[str]) -> tuple[PipelineConfig, TrackingConfig]:
    """Return the settings of pipeline and tracker; the tracker's begin with `tracking.`."""
    prefix = 'tracking.'
    own = [pair[len(prefix):] for pair in pairs if pair.startswith(prefix)]
    others = [pair for pair in pairs if not pair.startswith(prefix)]
    return with_flags(PipelineConfig(), others), with_flags(TrackingConfig(), own)


def measure(options: argparse.Namespace, console: Console) -> list[FollowedSequence]:
    """Run the methods on every sequence that is not known from an earlier run."""
    config, tracking = configs(options.set)
    model, detector = default_body(), GivenDetections()
    pipeline = BodyPipeline(model, default_library(), detector, config)
    filmed = [options.frames, options.rate, options.sensor, options.methods]
    folder = cache_folder() / f'tracking-{run_key([repr(config), repr(tracking), repr(filmed)])}'
    work = [(kind, options.seed + k) for kind in options.kinds for k in range(options.seeds)]
    columns = (TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
               TimeRemainingColumn())
    sequences, warm = [], False
    with Progress(*columns, console=console) as progress:
        task = progress.add_task('frames', total=len(work) * options.frames)
        for number, (kind, seed) in enumerate(work):
            progress.update(task, description=kind, completed=number * options.frames)
            path = folder / f'{kind}-{seed}.npz'
            if not path.is_file():
                film = SequenceConfig(
                    SequenceKind(kind), options.frames, options.rate, options.sensor, colour=False)
                if not warm:  # compilation belongs to nobody's time
                    methods = make_methods(options.methods, pipeline, tracking)
                    frames = islice(film_sequence(model, seed, film), WARM_FRAMES)
                    follow(frames, options.rate, methods, detector, lambda: None)
                    warm = True
                methods = make_methods(options.methods, pipeline, tracking)
                truth, tracks = follow(
                    film_sequence(model, seed, film), options.rate, methods, detector,
                    lambda: progress.advance(task))
                save_tables(path, truth, tracks)
            sequences.append(with_rows(kind, *load_tables(path, options.methods)))
        progress.update(task, completed=len(work) * options.frames)
    return sequences
