"""Accuracy on synthetic scenes of occluded people: the paper's table and what it leaves out.

    python -m benchmarks accuracy --frames 100 --json accuracy.json

Finished frames are kept under a key of settings, code and data: an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmarks.accuracy_cache import FrameCache, cache_folder, run_key
from benchmarks.accuracy_methods import (
    GivenDetections,
    MeanBody,
    Method,
    Pipeline,
    RetrievalOnly,
)
from benchmarks.accuracy_paper import paper_subset, paper_table
from benchmarks.accuracy_records import match, person_record
from benchmarks.accuracy_summary import (
    coverage_lines,
    group_lines,
    shape_lines,
    summarise,
    table,
)
from benchmarks.arguments import positive
from pop_core.body.default_body import default_body
from pop_core.body.model import BodyModel
from pop_core.config import PipelineConfig
from pop_core.fitting.fitting_config import FittingConfig
from pop_core.keypoints.detection import KeypointDetector
from pop_core.keypoints.fusion import FusedDetector
from pop_core.pipeline import BodyPipeline
from pop_core.retrieval.default_library import default_library
from pop_core.retrieval.pose_library import PoseLibrary
from pop_core.retrieval.retrieve import RetrievalConfig
from pop_core.settings import Value, apply_settings
from pop_core.synthesis.scene_config import SceneConfig
from pop_core.synthesis.scenes import SyntheticScene, synthesise_scene
from pop_ros.keypoint_sources import apply_settings as apply_to_source
from pop_ros.keypoint_sources import make_detector
from pop_ros.settings_flags import with_flags

FIRST_SEED = 10_000  # far from the seeds of tests and training
MAIN = 'pop'
TRUTH = 'truth'  # the scenes' own keypoints, with the errors of a good network in colour


def of_k(k: int) -> dict[str, Value]:
    """Return the settings of K hypotheses: as large a share of them is fitted on as of the six."""
    fitting, usual = FittingConfig(), RetrievalConfig().candidates
    kept = {
        f'fitting.{name}': max(1, round(k * getattr(fitting, name) / usual))
        for name in ('surface_hypotheses', 'final_hypotheses')}
    return {'retrieval.candidates': k, **kept}


# Name and the settings that differ from the main method's.
ABLATIONS: dict[str, dict[str, Value]] = {
    'K=1': of_k(1), 'K=3': of_k(3), 'K=12': of_k(12),
    'no free space': {'fitting.free_space': False},
    'no cond. prior': {'fitting.neighbour_weight': 0.0},
    'no completion': {'use_completion': False},
    'no limb trials': {'fitting.limb_trials': 0},
}


def run(argv: list[str]) -> int:
    """Measure, print the table, write JSON and pictures when asked to."""
    options = parse(argv)
    config = with_flags(PipelineConfig(), options.set)
    model, console = default_body(), make_console()
    detector = GivenDetections()
    console.print('Loading the pose library ...')
    methods = make_methods(default_library(), detector, config, options)
    key = run_key([repr(config), repr(options.keypoints), repr(sorted(methods))])
    cache = FrameCache(cache_folder() / f'accuracy-{key}.jsonl')
    seeds = range(options.seed, options.seed + options.frames)
    measure(model, methods, detector, seeds=seeds, cache=cache, console=console)
    entries = [cache.done[seed] for seed in seeds]
    report = summary_of(entries, list(methods))
    print_report(report, console)
    console.print(paper_table(paper_subset(entries, MAIN)))
    for line in [*group_lines(people_of(entries, MAIN)), *shape_lines(people_of(entries, MAIN))]:
        console.print(line)
    if options.json is not None:
        people = {name: people_of(entries, name) for name in methods}
        options.json.write_text(json.dumps(report | {'records': people}), encoding='utf-8')
    if options.pictures is not None:
        from benchmarks.accuracy_pictures import draw_pictures

        draw_pictures(options.pictures, people_of(entries, MAIN), model, methods[MAIN], detector)
    return 0


def parse(argv: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks accuracy', description=__doc__)
    parser.add_argument('--frames', type=positive, default=500, help='number of scenes')
    parser.add_argument('--seed', type=int, default=FIRST_SEED, help='seed of the first scene')
    parser.add_argument('--json', type=Path, help='file to write all figures into')
    parser.add_argument('--pictures', type=Path, help='folder for curves and error heat maps')
    parser.add_argument(
        '--keypoints', default=TRUTH, metavar='SOURCE',
        help="'truth' (with noise), sources as in `pop fit`, or both: 'truth,depth'")
    parser.add_argument('--ablations', action='store_true', help='run the variants too')
    parser.add_argument('--no-baselines', action='store_true', help='only the pipeline')
    parser.add_argument(
        '--set', action='append', default=[], metavar='NAME=VALUE', help='change a setting')
    return parser.parse_args(argv)


def make_methods(
    library: PoseLibrary, detector: GivenDetections, config: PipelineConfig,
    options: argparse.Namespace,
) -> dict[str, Method]:
    """Return what is compared, the pipeline first."""
    model = default_body()
    source = make_source(options.keypoints, detector, config)
    pipeline = BodyPipeline(model, library, source, config)
    methods: dict[str, Method] = {MAIN: Pipeline(pipeline)}
    if not options.no_baselines:
        methods |= {'retrieval': RetrievalOnly(pipeline), 'mean body': MeanBody(pipeline)}
    if options.ablations:
        for name, changes in ABLATIONS.items():
            variant = BodyPipeline(model, library, source, apply_settings(config, changes))
            methods[name] = Pipeline(variant)
    return methods


def make_source(
    keypoints: str, given: GivenDetections, config: PipelineConfig
) -> KeypointDetector:
    """Return the keypoint source: what is given, what `pop fit` would use, or both merged.

    Raises:
        PopError: If there is no such source.
    """
    named = keypoints.split(',')
    others = ','.join(name for name in named if name != TRUTH)
    if not others:
        return given
    source = make_detector(others)
    apply_to_source(source, config)
    return FusedDetector([given, source], config=config.fusion) if TRUTH in named else source


def measure(
    model: BodyModel, methods: dict[str, Method], detector: GivenDetections, *, seeds: range,
    cache: FrameCache, console: Console,
) -> None:
    """Run every method on every scene that the cache does not hold yet."""
    columns = (TextColumn('scenes'), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task('scenes', total=len(seeds))
        warm = False
        for seed in seeds:
            if seed not in cache.done:
                scene = synthesise_scene(model, seed, SceneConfig())
                if not warm:  # compilation belongs to nobody's time
                    scene_entry(model, scene, methods, detector)
                    warm = True
                cache.add(scene_entry(model, scene, methods, detector))
            progress.advance(task)


def scene_entry(
    model: BodyModel, scene: SyntheticScene, methods: dict[str, Method], detector: GivenDetections
) -> dict[str, Any]:
    """Return the records of all methods on one scene.

    People whose keypoints are too few to be found by anybody are counted, not scored.
    """
    detections = scene.detections()
    detector.people = [detection for detection in detections if detection is not None]
    scored = [
        person for person, detection in zip(scene.people, detections, strict=True)
        if detection is not None]
    entry: dict[str, Any] = {
        'seed': scene.seed, 'unseen': len(scene.people) - len(scored), 'methods': {}}
    for name, method in methods.items():
        guesses, times_ms = method(scene.frame)
        pairs = match(model, guesses, scored)
        people = [
            person_record(model, scene, person, guesses[pairs[k]] if k in pairs else None)
            for k, person in enumerate(scored)]
        entry['methods'][name] = {
            'people': people, 'times_ms': times_ms, 'extra': len(guesses) - len(pairs)}
    return entry


def people_of(entries: list[dict[str, Any]], name: str) -> list[dict[str, Any]]:
    """Return one method's records of all people."""
    return [record for entry in entries for record in entry['methods'][name]['people']]


def summary_of(entries: list[dict[str, Any]], names: list[str]) -> dict[str, Any]:
    """Return the report: statistics per method, stage times of the main one."""
    times: dict[str, list[float]] = {}
    per_person = []
    for entry in entries:
        main = entry['methods'][MAIN]
        for step, spent in main['times_ms'].items():
            times.setdefault(step, []).append(spent)
        if main['people']:
            per_person.append(sum(main['times_ms'].values()) / len(main['people']))
    return {
        'frames': len(entries), 'first_seed': entries[0]['seed'],
        'unseen': sum(entry['unseen'] for entry in entries),
        'extra': sum(entry['methods'][MAIN]['extra'] for entry in entries),
        'methods': {name: summarise(people_of(entries, name)) for name in names},
        'median_times_ms': {step: float(np.median(spent)) for step, spent in times.items()},
        'median_ms_per_person': float(np.median(per_person)) if per_person else float('nan'),
    }


def make_console() -> Console:
    """Return a console wide enough for the table, also where output goes into a file."""
    console = Console(highlight=False, markup=False)
    return console if console.is_terminal else Console(highlight=False, markup=False, width=190)


def print_report(report: dict[str, Any], console: Console) -> None:
    """Print table, calibration and times."""
    console.print(table(report['methods'], MAIN))
    console.print(
        f'{report["frames"]} scenes; {report["unseen"]} people with too few keypoints left out, '
        f'{report["extra"]} bodies that match nobody')
    for line in coverage_lines(report['methods'][MAIN]):
        console.print(line)
    steps = ', '.join(f'{step} {spent:.0f}' for step, spent in report['median_times_ms'].items())
    console.print(
        f'median {report["median_ms_per_person"]:.0f} ms per person; per frame [ms]: {steps}')
