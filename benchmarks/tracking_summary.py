"""Figures of all sequences, and the tables that show them side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int
from rich.table import Table

from benchmarks import metrics
from benchmarks.tracking_metrics import (
    MotScores,
    acceleration_errors,
    correspond,
    mot_scores,
    static_std_m,
)
from benchmarks.tracking_records import TrackTable, TruthTable
from pop_core.estimate import JointState

# Name and longest time since the camera saw a joint [s]; the first is of joints it sees now.
SINCE_SEEN = (
    ('seen now', 0.0), ('up to 0.5 s', 0.5), ('0.5 to 1 s', 1.0), ('1 to 2 s', 2.0),
    ('2 to 3 s', 3.0), ('over 3 s', 1e9), ('never seen yet', np.inf))
STILL = 'still'


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table.

    Args:
        label: What it says.
        path: Keys that lead to the figure in a summary.
        form: How it is written.
        factor: What it is multiplied with.
    """

    label: str
    path: tuple[str, ...]
    form: str
    factor: float = 1.0


def _rows() -> tuple[Row, ...]:
    joints = [
        Row(f'{part} joints, {statistic}', (f'{part}_m', statistic), '{:.1f} mm', 1e3)
        for part in ('visible', 'occluded') for statistic in ('mean', 'median', 'p90')]
    times = [
        Row(f'  {label}', ('since_seen_m', label, 'mean'), '{:.1f} mm', 1e3)
        for label, _ in SINCE_SEEN]
    spent = [
        Row(f'per frame, {clock} time, {statistic}', (key, statistic), '{:.0f} ms')
        for clock, key in (('wall', 'wall_ms'), ('processor', 'cpu_ms'))
        for statistic in ('median', 'p95')]
    return (
        *joints, *times,
        Row('MOTA', ('mota',), '{:.1f} %', 100), Row('IDF1', ('idf1',), '{:.1f} %', 100),
        Row('id switches per 1,000 frames', ('switches_per_1000_frames',), '{:.1f}'),
        Row('people missed', ('misses',), '{:.0f}'),
        Row('bodies of nobody', ('extra',), '{:.0f}'),
        Row('acceleration error', ('acceleration_error_m_s2',), '{:.1f} m/s2'),
        Row('static std, visible joints', ('static_std_m', 'visible'), '{:.1f} mm', 1e3),
        Row('static std, hidden joints', ('static_std_m', 'hidden'), '{:.1f} mm', 1e3),
        Row('hidden joints in the 68 % ellipsoid', ('coverage_hidden', '68'), '{:.0f} %', 100),
        Row('hidden joints in the 95 % ellipsoid', ('coverage_hidden', '95'), '{:.0f} %', 100),
        *spent, Row('frames per second', ('frames_per_s',), '{:.1f}'))


ROWS = _rows()


@dataclass(frozen=True, slots=True, eq=False)
class FollowedSequence:
    """One sequence with the results of all methods.

    Args:
        kind: What happens in it.
        truth: Truth.
        tracks: Results by method.
        rows: Row of the results that is each row of the truth, -1 where none is, by method.
    """

    kind: str
    truth: TruthTable
    tracks: dict[str, TrackTable]
    rows: dict[str, Int[np.ndarray, 'n']]

    @property
    def shared(self) -> Bool[np.ndarray, 'n']:
        """Return the people and frames that every method has found: errors compare only there."""
        return np.all([rows >= 0 for rows in self.rows.values()], axis=0)


def with_rows(kind: str, truth: TruthTable, tracks: dict[str, TrackTable]) -> FollowedSequence:
    """Return a sequence with bodies given to people."""
    rows = {name: correspond(truth, table) for name, table in tracks.items()}
    return FollowedSequence(kind, truth, tracks, rows)


def summarise(sequences: Sequence[FollowedSequence], name: str) -> dict[str, Any]:
    """Return all figures of one method."""
    errors, unseen_s, hidden = _pooled(sequences, name)
    scores = sum((mot_scores(s.truth, s.tracks[name], s.rows[name]) for s in sequences),
                 MotScores())
    wall = np.concatenate([s.tracks[name].wall_ms for s in sequences])
    return {
        'visible_m': _statistics(errors[~hidden]), 'occluded_m': _statistics(errors[hidden]),
        'since_seen_m': _by_time(errors, unseen_s),
        'alone_m': _statistics(_found_alone(sequences, name)),
        'mota': scores.mota, 'idf1': scores.idf1,
        'switches_per_1000_frames': scores.switches_per_1000, 'switches': scores.switches,
        'misses': scores.misses, 'extra': scores.extra, 'required': scores.required,
        'static_std_m': _steadiness(sequences, name),
        'acceleration_error_m_s2': _acceleration(sequences, name),
        'coverage_hidden': _coverage(sequences, name),
        'frames': len(wall), 'frames_per_s': 1000.0 / float(wall.mean()),
        'wall_ms': _times([s.tracks[name].wall_ms for s in sequences]),
        'cpu_ms': _times([s.tracks[name].cpu_ms for s in sequences]),
    }


def by_kind(sequences: Sequence[FollowedSequence], name: str) -> dict[str, dict[str, float]]:
    """Return the main figures of one method for every kind of sequence."""
    out = {}
    for kind in dict.fromkeys(s.kind for s in sequences):
        own = [s for s in sequences if s.kind == kind]
        errors, _, hidden = _pooled(own, name)
        scores = sum((mot_scores(s.truth, s.tracks[name], s.rows[name]) for s in own),
                     MotScores())
        out[kind] = {
            'visible_m': _mean(errors[~hidden]), 'occluded_m': _mean(errors[hidden]),
            'mota': scores.mota, 'idf1': scores.idf1, 'switches': scores.switches,
            'cpu_ms': float(np.median(np.concatenate([s.tracks[name].cpu_ms for s in own]))),
            'wall_ms': float(np.median(np.concatenate([s.tracks[name].wall_ms for s in own]))),
        }
    return out


def comparison(summaries: dict[str, dict[str, Any]]) -> Table:
    """Return the figures of all methods side by side; changes are of the last to the first."""
    shown = Table()
    shown.add_column('metric', no_wrap=True)
    for name in (*summaries, 'change', 'joints'):
        shown.add_column(name, justify='right', no_wrap=True)
    for row in ROWS:
        values = [_looked_up(summary, row.path) for summary in summaries.values()]
        change = ''
        if len(values) > 1 and values[0] and np.isfinite(values).all():
            change = f'{100 * (values[-1] / values[0] - 1):+.0f} %'
        first = _looked_up(next(iter(summaries.values())), row.path[:-1])
        n = str(first['n']) if 'n' in first and row.path[-1] == 'mean' else ''
        shown.add_row(row.label, *(row.form.format(row.factor * v) for v in values), change, n)
    return shown


def kind_table(kinds: dict[str, dict[str, dict[str, float]]]) -> Table:
    """Return the main figures by kind of sequence: method by method in each cell."""
    shown = Table(title=' / '.join(kinds), title_justify='left')
    for name in ('kind', 'visible mm', 'occluded mm', 'MOTA %', 'IDF1 %', 'switches',
                 'processor ms', 'wall ms'):
        shown.add_column(name, justify='left' if name == 'kind' else 'right', no_wrap=True)
    columns = (('visible_m', 1e3, 0), ('occluded_m', 1e3, 0), ('mota', 100, 0), ('idf1', 100, 0),
               ('switches', 1, 0), ('cpu_ms', 1, 0), ('wall_ms', 1, 0))
    for kind in next(iter(kinds.values())):
        shown.add_row(kind, *(
            ' / '.join(f'{factor * values[kind][key]:.{digits}f}' for values in kinds.values())
            for key, factor, digits in columns))
    return shown


def _pooled(
    sequences: Sequence[FollowedSequence], name: str
) -> tuple[Float[np.ndarray, 'n'], Float[np.ndarray, 'n'], Bool[np.ndarray, 'n']]:
    """Return error, time since seen and hiddenness of the 14 pose joints of shared rows."""
    chosen = metrics.pose_joints()
    errors, unseen_s, hidden = [], [], []
    for s in sequences:
        own = s.shared & s.truth.required
        found = s.tracks[name].joints[s.rows[name][own]]
        distance = np.linalg.norm(found - s.truth.joints[own], axis=2)
        errors.append(distance[:, chosen].ravel())
        unseen_s.append(s.truth.unseen_s[own][:, chosen].ravel())
        hidden.append((s.truth.state[own] != JointState.VISIBLE)[:, chosen].ravel())
    return np.concatenate(errors), np.concatenate(unseen_s), np.concatenate(hidden)


def _by_time(
    errors: Float[np.ndarray, 'n'], unseen_s: Float[np.ndarray, 'n']
) -> dict[str, dict[str, float]]:
    out, low = {}, -1.0
    for label, high in SINCE_SEEN:
        out[label] = _statistics(errors[(unseen_s > low) & (unseen_s <= high)])
        low = high
    return out


def _found_alone(sequences: Sequence[FollowedSequence], name: str) -> Float[np.ndarray, 'n']:
    """Return errors of people whom only this method gives out, or who need not be found."""
    out = [np.zeros(0)]
    for s in sequences:
        own = (s.rows[name] >= 0) & ~(s.shared & s.truth.required)
        found = s.tracks[name].joints[s.rows[name][own]]
        distance = np.linalg.norm(found - s.truth.joints[own], axis=2)
        out.append(distance[:, metrics.pose_joints()].ravel())
    return np.concatenate(out)


def _steadiness(sequences: Sequence[FollowedSequence], name: str) -> dict[str, float]:
    """Return the mean static std of visible and of hidden joints [m] of people who stand still."""
    std: dict[str, list[float]] = {'visible': [], 'hidden': []}
    for s in sequences:
        if s.kind == STILL:
            per_joint = static_std_m(s.truth, s.tracks[name], s.rows[name])
            visible = s.truth.state[0] == JointState.VISIBLE
            std['visible'] += per_joint[visible].tolist()
            std['hidden'] += per_joint[~visible].tolist()
    return {part: _mean(np.array(values)) for part, values in std.items()}


def _acceleration(sequences: Sequence[FollowedSequence], name: str) -> float:
    return _mean(np.concatenate([
        acceleration_errors(s.truth, s.tracks[name], s.rows[name]) for s in sequences]))


def _coverage(sequences: Sequence[FollowedSequence], name: str) -> dict[str, float]:
    """Return the share of hidden joints inside their stated 68 and 95 % ellipsoids."""
    squared = [np.zeros(0)]
    for s in sequences:
        own = s.shared & s.truth.required
        hidden = s.truth.state[own] != JointState.VISIBLE
        table, rows = s.tracks[name], s.rows[name][own]
        squared.append(metrics.mahalanobis2(
            table.joints[rows][hidden], s.truth.joints[own][hidden],
            table.covariance[rows][hidden]))
    pooled = np.concatenate(squared)
    return {'68': metrics.share_within(pooled, metrics.CHI2_3_68),
            '95': metrics.share_within(pooled, metrics.CHI2_3_95)}


def _looked_up(summary: dict[str, Any], path: tuple[str, ...]) -> Any:
    for key in path:
        summary = summary[key]
    return summary


def _times(parts: Sequence[Float[np.ndarray, 'f']]) -> dict[str, float]:
    spent = np.concatenate(parts)
    return {'median': float(np.median(spent)), 'p95': float(np.percentile(spent, 95)),
            'mean': float(spent.mean())}


def _statistics(errors: Float[np.ndarray, 'n']) -> dict[str, float]:
    if not len(errors):
        return {'mean': float('nan'), 'median': float('nan'), 'p90': float('nan'), 'n': 0}
    return {'mean': float(errors.mean()), 'median': float(np.median(errors)),
            'p90': float(np.percentile(errors, 90)), 'n': len(errors)}


def _mean(values: Float[np.ndarray, 'n']) -> float:
    return float(values.mean()) if len(values) else float('nan')
