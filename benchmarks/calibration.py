"""How sure is a joint? Learns what widens covariances, and checks it on other people.

    python -m benchmarks calibration frames     single frames: constants of SINGLE_FRAME
    python -m benchmarks calibration tracks     people who are followed: constants of TRACKED

Prints the learned constants, and for people that nothing was learned from how many joints lie in
their 68 and 95 % ellipsoids, how large these are, and how likely the errors were. None of them
is in the other benchmarks. Finished scenes are kept: an interrupted run goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from benchmarks import metrics
from benchmarks.accuracy import make_console
from benchmarks.accuracy_cache import cache_folder, run_key
from benchmarks.calibration_fit import Sample, joined, learn, squared_radii
from benchmarks.calibration_samples import (
    Witness,
    load_sample,
    save_sample,
    scene_sample,
    sequence_sample,
)
from pop_core.estimate import JointState
from pop_core.fitting.calibration import SINGLE_FRAME
from pop_core.fitting.uncertainty import Calibration
from pop_core.synthesis.sensor_noise import SENSORS
from pop_core.synthesis.sequence import SequenceConfig
from pop_core.synthesis.sequence_names import SequenceKind
from pop_core.tracking.calibration import TRACKED

LEARN_SEED, CHECK_SEED = 500_000, 600_000  # far from those of benchmarks, tests and training
FRAMES = 120  # of each sequence
Maker = Callable[[], 'Sample | None']


def run(argv: list[str]) -> int:
    """Collect, learn, check, print."""
    options = parse(argv)
    console = make_console()
    console.print('Loading the pose library ...')
    witness = Witness()
    make = scene_jobs if options.what == 'frames' else sequence_jobs
    present = SINGLE_FRAME if options.what == 'frames' else TRACKED
    learned_from = collect(make(witness, options.seed, options.learn), console, 'to learn from')
    checked_on = collect(make(witness, CHECK_SEED, options.check), console, 'to check on')
    console.print('Learning: a minute or two ...')
    learned = learn(learned_from, present)
    console.print(f'Learned from {len(learned_from.truth) // 24} bodies:')
    for name in Calibration.__slots__:
        console.print(f'  {name} = {written(getattr(learned, name))}')
    console.print(comparison(checked_on, {'in the code': present, 'learned': learned}))
    return 0


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        prog='python -m benchmarks calibration', description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('what', choices=('frames', 'tracks'), help='which constants')
    parser.add_argument(
        '--learn', type=int, help='scenes, or sequences of each kind, to learn from')
    parser.add_argument('--check', type=int, help='the same, to check on')
    parser.add_argument('--seed', type=int, default=LEARN_SEED, help='seed of the first to learn')
    options = parser.parse_args(argv)
    usual = (400, 300) if options.what == 'frames' else (4, 2)
    options.learn = usual[0] if options.learn is None else options.learn
    options.check = usual[1] if options.check is None else options.check
    return options


def scene_jobs(witness: Witness, seed: int, count: int) -> dict[str, Maker]:
    """Return what makes the sample of each scene, by name."""
    return {f'scene-{s}': partial(scene_sample, witness, s) for s in range(seed, seed + count)}


def sequence_jobs(witness: Witness, seed: int, count: int) -> dict[str, Maker]:
    """Return what makes the sample of each sequence, by name; sensors take turns."""
    sensors = sorted(SENSORS)
    jobs: dict[str, Maker] = {}
    for s in range(seed, seed + count):
        for kind in SequenceKind:
            film = SequenceConfig(kind, FRAMES, sensor=sensors[s % len(sensors)], colour=False)
            jobs[f'{kind.value}-{s}'] = partial(sequence_sample, witness, s, film)
    return jobs


def collect(jobs: dict[str, Maker], console: Console, label: str) -> Sample:
    """Return the samples of all jobs as one; finished ones are read from the cache."""
    folder = cache_folder() / f'calibration-{run_key([])}'
    columns = (TextColumn(label), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    samples = []
    with Progress(*columns, console=console) as progress:
        for name, make in progress.track(jobs.items(), total=len(jobs)):
            path = folder / f'{name}.npz'
            if path.is_file():
                samples.append(load_sample(path))
                continue
            sample = make()
            if sample is not None:
                save_sample(path, sample)
                samples.append(sample)
    if not samples:
        raise SystemExit(f'calibration: expected people {label}, found nobody: ask for more')
    return joined(samples)


def written(value: float | Sequence[float] | np.ndarray) -> str:
    """Return constants with three digits."""
    return np.array2string(np.asarray(value), precision=3, separator=', ')


def comparison(sample: Sample, calibrations: dict[str, Calibration]) -> Table:
    """Return what calibrations say of the same joints, side by side."""
    shown = Table()
    shown.add_column('of people nothing was learned from')
    for name in calibrations:
        shown.add_column(name, justify='right')
    columns = [figures(sample, calibration) for calibration in calibrations.values()]
    for label in columns[0]:
        shown.add_row(label, *(column[label] for column in columns))
    return shown


def figures(sample: Sample, calibration: Calibration) -> dict[str, str]:
    """Return coverage by true state, size of ellipsoids and likelihood, by name."""
    squared, log_det = squared_radii(sample, calibration)
    hidden = sample.truth != JointState.VISIBLE
    groups = {state.name.lower(): sample.truth == state for state in JointState}
    groups |= {'all hidden': hidden, 'unnamed limbs': sample.evidence.unnamed}
    out = {
        f'{name} in 68 / 95 %': _shares(squared[chosen])
        for name, chosen in groups.items() if chosen.any()}
    wanted = float(np.quantile(squared, 0.94)) / metrics.CHI2_3_95
    likelihood = -0.5 * (log_det + squared + 3.0 * np.log(2.0 * np.pi))
    return out | {
        'mean sigma, geometric': f'{1e3 * np.exp(log_det.mean() / 6):.1f} mm',
        'the same, widened to hold 94 %':
            f'{1e3 * np.exp(log_det.mean() / 6) * np.sqrt(wanted):.1f} mm',
        'mean log likelihood, normal': f'{likelihood.mean():.2f}',
    }


def _shares(squared: np.ndarray) -> str:
    inside = [metrics.share_within(squared, r) for r in (metrics.CHI2_3_68, metrics.CHI2_3_95)]
    return f'{100 * inside[0]:.0f} / {100 * inside[1]:.0f} %'
