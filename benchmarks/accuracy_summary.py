"""Means, medians, percentiles and failures over people, and the table beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table

from benchmarks import metrics
from benchmarks.accuracy_records import Record
from pop_core.estimate import JointState

FAILURE_M = 0.100


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Args:
        key: Name in the records.
        label: What it says.
        unit: 'mm' (from metres), '%' (from shares) or ''.
        paper: The paper's figure in that unit, as reported on its own frames, or None.
    """

    key: str
    label: str
    unit: str
    paper: float | None = None


ROWS = (
    Row('err_beta', 'err_beta, Eq. 3', '', 1.0008),
    Row('err_J', 'err_J, 23 joints, Eq. 4', 'mm', 115.7),
    Row('err_pose', 'err_pose, 14 joints, Eq. 5', 'mm', 151.5),
    Row('err_visible', 'visible joints, Eq. 6', 'mm', 133.5),
    Row('err_occluded', 'occluded joints, Eq. 7', 'mm', 272.4),
    Row('err_self_occluded', '  hidden by the own body', 'mm'),
    Row('err_scene_occluded', '  hidden by the scene', 'mm'),
    Row('err_out_of_image', '  out of the image', 'mm'),
    Row('p2p_vertex', 'points to vertices, Eq. 8', 'mm', 22.8),
    Row('p2p_vertex_truth', '  the truth body itself', 'mm'),
    Row('p2p_surface', 'points to surface', 'mm'),
    Row('p2p_surface_truth', '  the truth body itself', 'mm'),
    Row('p2p_above_truth', '  above the truth body', 'mm'),
    Row('within_3cm', 'points within 3 cm of a vertex', '%'),
    Row('within_6cm', 'points within 6 cm of a vertex', '%'),
    Row('mpjpe_root', 'MPJPE, root aligned', 'mm'),
    Row('pa_mpjpe', 'PA-MPJPE', 'mm'),
    Row('map_10cm', 'joints within 10 cm (mAP)', '%'),
    Row('pve', 'vertices (PVE)', 'mm'),
    Row('tpose', 'T-pose vertices', 'mm'),
    Row('tpose_bare', '  of the unclothed', 'mm'),
    Row('stature', 'stature', 'mm'),
    Row('stature_bare', '  of the unclothed', 'mm'),
    Row('too_tall', '  too tall (+), too short (-)', 'mm'),
    Row('free_space', 'free-space violation', '%'),
    Row('free_space_truth', '  the truth body itself', '%'),
    Row('iou', 'mask IoU', '%'),
    Row('precision', 'mask precision', '%'),
    Row('recall', 'mask recall', '%'),
    Row('oracle_pose', 'err_pose of the best hypothesis', 'mm'),
)
FACTORS = {'mm': 1000.0, '%': 100.0, '': 1.0}


def summarise(records: Sequence[Record]) -> dict[str, Any]:
    """Return the statistics of a method over all people it should have found."""
    found = [with_bare(record) for record in records if record['found']]
    failed = [r for r in records if not r['found'] or r['err_pose'] > FAILURE_M]
    out: dict[str, Any] = {
        'people': len(records), 'found': len(found),
        'failure_rate': len(failed) / max(len(records), 1),
        'coverage': coverage(found), 'metrics': {},
    }
    for row in ROWS:
        values = np.array([record.get(row.key, np.nan) for record in found], dtype=np.float64)
        values = values[np.isfinite(values)]
        if len(values):
            out['metrics'][row.key] = {
                'mean': float(values.mean()), 'median': float(np.median(values)),
                'p90': float(np.percentile(values, 90)), 'n': len(values),
            }
    return out


def with_bare(record: Record) -> Record:
    """Return the record with shape figures of unclothed people under names of their own."""
    if not record['bare']:
        return record
    return record | {'tpose_bare': record['tpose'], 'stature_bare': record['stature']}


def coverage(found: Sequence[Record]) -> dict[str, dict[str, float]]:
    """Return per joint state the share of joints inside their stated 68 and 95 % ellipsoids."""
    stated = [record for record in found if 'mahalanobis2' in record]
    if not stated:
        return {}
    squared = np.array([record['mahalanobis2'] for record in stated])
    state = np.array([record['state'] for record in stated])
    out = {}
    for kind in (JointState.VISIBLE, JointState.SELF_OCCLUDED, JointState.SCENE_OCCLUDED,
                 JointState.OUT_OF_IMAGE):
        chosen = squared[state == kind]
        if len(chosen):
            out[kind.name.lower()] = {
                '68': metrics.share_within(chosen, metrics.CHI2_3_68),
                '95': metrics.share_within(chosen, metrics.CHI2_3_95), 'n': len(chosen),
            }
    return out


def table(summaries: dict[str, dict[str, Any]], main: str) -> Table:
    """Return the main method's mean, median and 90th percentile beside the others' means."""
    shown = Table(title=f'{summaries[main]["people"]} people', title_justify='left')
    shown.add_column('metric', no_wrap=True)
    for name in ('mean', 'median', 'p90'):
        shown.add_column(f'{main}\n{name}', justify='right', no_wrap=True)
    others = [name for name in summaries if name != main]
    for name in others:
        shown.add_column(f'{name}\nmean', justify='right', no_wrap=True)
    shown.add_column('paper, as\nreported, on its\nown frames', justify='right')
    for row in ROWS:
        cells = summaries[main]['metrics'].get(row.key)
        if cells is None:
            continue
        means = [summaries[name]['metrics'].get(row.key, {}).get('mean') for name in others]
        values = [cells['mean'], cells['median'], cells['p90'], *means]
        paper = '' if row.paper is None else f'{row.paper:g} {row.unit}'
        shown.add_row(row.label, *(_number(value, row.unit) for value in values), paper)
    rates = [summaries[name]['failure_rate'] for name in (main, *others)]
    shown.add_row('failures (> 100 mm or not found)', _number(rates[0], '%'), '', '',
                  *(_number(rate, '%') for rate in rates[1:]), '')
    return shown


def group_lines(records: Sequence[Record]) -> list[str]:
    """Return sentences on where errors come from: poses, sensors, children."""
    lines = []
    for name in ('kind', 'sensor', 'child'):
        cells = []
        for value in sorted({record[name] for record in records}, key=str):
            group = [record for record in records if record[name] == value]
            errors = [record['err_pose'] for record in group if record['found']]
            failed = len(group) - sum(error <= FAILURE_M for error in errors)
            median = 1000 * float(np.median(errors)) if errors else float('nan')
            cells.append(f'{value} {median:.0f} mm, {failed} of {len(group)} failed')
        lines.append(f'by {name} (median err_pose): ' + '; '.join(cells))
    return lines


def shape_lines(records: Sequence[Record]) -> list[str]:
    """Return sentences on whose shape is wrong, and to which side: clothes, sizes, poses."""
    lines = []
    for name in ('bare', 'child', 'kind', 'sensor'):
        cells = []
        for value in sorted({record[name] for record in records}, key=str):
            group = [r for r in records if r[name] == value and r['found']]
            if group:
                tpose, stature, too_tall = (
                    1000 * float(np.mean([record[key] for record in group]))
                    for key in ('tpose', 'stature', 'too_tall'))
                cells.append(
                    f'{value} {tpose:.0f} mm, {stature:.0f} mm ({too_tall:+.0f}), {len(group)}')
        lines.append(f'by {name} (T-pose, stature (too tall), people): ' + '; '.join(cells))
    return lines


def coverage_lines(summary: dict[str, Any]) -> list[str]:
    """Return sentences on how well the stated covariances hold."""
    return [
        f'{state}: {100 * share["68"]:.0f} % in the 68 % ellipsoid, '
        f'{100 * share["95"]:.0f} % in the 95 % one ({share["n"]} joints)'
        for state, share in summary['coverage'].items()
    ]


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return ''
    scaled = value * FACTORS[unit]
    return f'{scaled:.3f}' if unit == '' else f'{scaled:.1f} {unit}'
