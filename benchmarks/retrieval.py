"""Retrieval: speed at the paper's scale, recall behind occlusion, coverage, and building speed.

    python -m benchmarks retrieval [PART ...] [--json FILE]

Parts: search (1.6 M poses), recall and coverage (held-back motion capture), build (1 M poses from
files), shortlist (a k-d tree against the exact search), index (faiss and hnswlib against it, where
installed); without any, all of them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.retrieval_build import measure_build
from benchmarks.retrieval_index import measure_index
from benchmarks.retrieval_recall import measure_coverage, measure_recall
from benchmarks.retrieval_search import measure_search, measure_shortlist

Rows = list[dict[str, object]]


def run(arguments: list[str]) -> int:
    """Run the parts asked for, print their tables, write JSON when asked to."""
    options = parse(arguments)
    console = Console(width=110)
    parts: dict[str, tuple[str, Callable[[], Rows]]] = {
        'search': ('Exact search', lambda: measure_search(options.poses, options.queries)),
        'recall': (
            'A pose within 10 cm (mean of 15 joints) among the answers, held-back motion capture',
            lambda: measure_recall(options.mocap, options.frames)),
        'coverage': (
            'Distance of held-back motion capture to the nearest pose [mm]',
            lambda: measure_coverage(options.mocap, options.frames)),
        'build': ('Building from files', lambda: measure_build(options.build_poses)),
        'shortlist': (
            'Exact search against a k-d tree shortlist',
            lambda: measure_shortlist(options.queries)),
        'index': (
            'Exact search of all or of an index\'s list: time, best 16 found, by share hidden',
            lambda: measure_index(options.mocap, options.queries, options.index_poses)),
    }
    results = {}
    for name in options.parts or parts:
        title, measure = parts[name]
        console.print(f'measuring {name} ...')
        results[name] = measure()
        if results[name]:
            console.print(table(title, results[name]))
    if options.json is not None:
        options.json.write_text(json.dumps(results, indent=1), encoding='utf-8')
    return 0


def parse(arguments: list[str]) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(prog='python -m benchmarks retrieval', description=__doc__)
    names = ('search', 'recall', 'coverage', 'build', 'shortlist', 'index')
    parser.add_argument('parts', nargs='*', choices=[*names, []], help='what to measure')
    parser.add_argument('--poses', type=int, default=1_600_000, help='size of the large library')
    parser.add_argument('--queries', type=int, default=30, help='queries to take the median of')
    parser.add_argument('--frames', type=int, default=300, help='held-back frames')
    parser.add_argument('--build-poses', type=int, default=1_000_000, help='poses to build from')
    parser.add_argument(
        '--index-poses', type=int, default=150_000, help='poses of the library that is indexed')
    parser.add_argument(
        '--mocap', type=Path, default=Path('../shared/data/mocap/cmu_smpl_train.npz'))
    parser.add_argument('--json', type=Path, help='file to write all figures into')
    return parser.parse_args(arguments)


def table(title: str, rows: Rows) -> Table:
    """Return rows of equal keys as a table."""
    out = Table(title=title)
    for name in rows[0]:
        out.add_column(name, justify='left' if isinstance(rows[0][name], str) else 'right')
    for row in rows:
        out.add_row(*(_text(value) for value in row.values()))
    return out


def _text(value: object) -> str:
    return f'{value:,.3g}' if isinstance(value, float) and value < 100 else (
        f'{value:,.0f}' if isinstance(value, int | float) else str(value))
