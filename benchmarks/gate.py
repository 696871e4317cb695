"""Does the pipeline still do what it did? A few seeded scenes against a committed baseline.

    python -m benchmarks gate             compare; exit code 1 when something became worse
    python -m benchmarks gate --update    write the baseline anew

Errors are compared as they are, with a tolerance for other processors and libraries; time as a
multiple of a fixed piece of work measured in the same run, so that slow machines do not fail.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.accuracy import FIRST_SEED, MAIN, scene_entry, summary_of
from benchmarks.accuracy_methods import GivenDetections, Pipeline
from pop_core.body.default_body import default_body
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.synthesis.scenes import synthesise_scene

BASELINE = Path(__file__).with_name('baseline.json')
FRAMES = 12
TIMED_SCENES = 4


@dataclass(frozen=True, slots=True)
class Metric:
    """One figure that must not become worse.

    Args:
        key: Name.
        value: Figure.
        unit: Its unit.
        direction: 'lower' or 'higher' is better.
        tolerance: How much worse it may be.
    """

    key: str
    value: float
    unit: str
    direction: str
    tolerance: float


# Name, statistic, direction, tolerance in metres or shares: about what one scene of twelve changes
# when an iteration ends differently on another processor.
WATCHED = (
    ('err_pose', 'median', 'lower', 0.006), ('err_pose', 'mean', 'lower', 0.012),
    ('err_visible', 'median', 'lower', 0.004), ('err_occluded', 'median', 'lower', 0.020),
    ('p2p_above_truth', 'median', 'lower', 0.002), ('tpose', 'median', 'lower', 0.004),
    ('free_space', 'median', 'lower', 0.015), ('iou', 'median', 'higher', 0.02),
)


def run(argv: list[str]) -> int:
    """Measure and compare, or write the baseline."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks gate', description=__doc__)
    parser.add_argument('--update', action='store_true', help='write the baseline anew')
    parser.add_argument('--baseline', type=Path, default=BASELINE, help='file to compare with')
    options = parser.parse_args(argv)
    found = measure()
    if options.update:
        text = json.dumps([asdict(metric) for metric in found], indent=1)
        options.baseline.write_text(text + '\n', encoding='utf-8')
        print(f'{options.baseline}: written')
        return 0
    known = json.loads(options.baseline.read_text(encoding='utf-8'))
    baseline = {item['key']: Metric(**item) for item in known}
    Console().print(comparison(found, baseline))
    return int(any(is_worse(metric, baseline[metric.key]) for metric in found))


def measure() -> list[Metric]:
    """Return the figures of the gate's scenes with the code as it is."""
    model, detector = default_body(), GivenDetections()
    method = Pipeline(BodyPipeline(model, default_library(), detector))
    entries = []
    for seed in track(range(FIRST_SEED, FIRST_SEED + FRAMES), 'Scenes'):
        entries.append(scene_entry(model, synthesise_scene(model, seed), {MAIN: method}, detector))
    report = summary_of(entries, [MAIN])
    timed = time_metric(entries[-TIMED_SCENES:])
    return [*accuracy_metrics(report['methods'][MAIN]), timed]


def accuracy_metrics(summary: dict[str, Any]) -> list[Metric]:
    """Return the watched figures of a summary, and the failure rate."""
    metrics = [
        Metric(f'{key} {statistic}', summary['metrics'][key][statistic], 'm or share', direction,
               tolerance)
        for key, statistic, direction, tolerance in WATCHED
    ]
    # One person more may fail.
    one = 1.0 / summary['people']
    return [*metrics, Metric('failures', summary['failure_rate'], 'share', 'lower', one)]


def time_metric(entries: list[dict[str, Any]]) -> Metric:
    """Return the time per person of warm scenes, in units of a fixed piece of work."""
    spent = [
        sum(entry['methods'][MAIN]['times_ms'].values())
        / max(len(entry['methods'][MAIN]['people']), 1)
        for entry in entries]
    ratio = float(np.median(spent)) / reference_ms()
    return Metric('time per person', ratio, 'x the reference work', 'lower', 0.6 * ratio)


def reference_ms() -> float:
    """Return the time of a fixed piece of work, the yardstick of this machine [ms].

    Half in the interpreter, half in arrays, as the pipeline; nothing of it is the project's own,
    which becomes faster itself.
    """
    values = np.random.default_rng(0).normal(size=50_000)
    spent = []
    for _ in range(15):
        start = time.perf_counter()
        np.exp(np.sort(values)).cumsum()
        sum(k * k for k in range(20_000))
        spent.append(time.perf_counter() - start)
    return 1e3 * float(np.median(spent))


def is_worse(found: Metric, baseline: Metric) -> bool:
    """Return whether a figure is worse than the baseline by more than the baseline tolerates."""
    change = found.value - baseline.value
    return (change if baseline.direction == 'lower' else -change) > baseline.tolerance


def comparison(found: list[Metric], baseline: dict[str, Metric]) -> Table:
    """Return the figures beside the baseline's."""
    table = Table()
    for name in ('metric', 'now', 'baseline', 'may change', ''):
        table.add_column(name, justify='right' if name in ('now', 'baseline') else 'left')
    for metric in found:
        known = baseline[metric.key]
        verdict = '[red]worse[/red]' if is_worse(metric, known) else 'fine'
        table.add_row(metric.key, f'{metric.value:.4f}', f'{known.value:.4f}',
                      f'{known.tolerance:.4f} {known.unit}', verdict)
    return table
