"""The node's health as diagnostic_msgs/DiagnosticArray."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from pop_ros.explanation import TopicReport, explain_refused_pairs
from pop_ros.pairing import FramePairer
from pop_ros.statistics import Snapshot

DROP_PREFIX = 'dropped: '
RECEIVED = 'received '
MISSED = 'colour images without depth'
WHY_MISSED = 'why without depth'
MANY_DROPS = 0.5  # share of dropped pairs since the last report that deserves a warning


def diagnostic_array(
    header: Header,
    name: str,
    snapshot: Snapshot,
    *,
    previous: Snapshot | None,
    pairer: FramePairer[Any],
    reports: Sequence[TopicReport],
    trouble: str,
) -> DiagnosticArray:
    """Return one status: level and sentence first, all counts and times as values.

    Args:
        header: Stamp of the report.
        name: Name of the status.
        snapshot: Counts now.
        previous: Counts at the report before, for the shares since then.
        pairer: Pairer of the inputs, for its counts.
        reports: State of the inputs.
        trouble: What keeps the node from working, or ''.
    """
    level, message = _judge(snapshot, previous, trouble)
    values = [KeyValue(key=key, value=value) for key, value in _values(snapshot, pairer, reports)]
    status = DiagnosticStatus(
        level=level, name=name, hardware_id='pop', message=message, values=values)
    return DiagnosticArray(header=header, status=[status])


def read_values(message: DiagnosticArray, name: str) -> dict[str, str] | None:
    """Return the values of the status of this name, or None if it is not there."""
    for status in message.status:
        if status.name == name:
            return {pair.key: pair.value for pair in status.values}
    return None


def percentiles(values_ms: Sequence[float]) -> str:
    """Return median and 95th percentile in words."""
    if not values_ms:
        return '-'
    p50, p95 = np.percentile(values_ms, [50, 95])
    return f'p50 {p50:.1f} ms, p95 {p95:.1f} ms'


def _judge(now: Snapshot, before: Snapshot | None, trouble: str) -> tuple[bytes, str]:
    if trouble:
        return DiagnosticStatus.WARN, trouble.splitlines()[0]
    new_frames = now.frames - (before.frames if before else 0)
    new_drops = sum(now.drops.values()) - (sum(before.drops.values()) if before else 0)
    if new_drops > MANY_DROPS * (new_frames + new_drops):
        return DiagnosticStatus.WARN, f'{new_drops} pairs dropped, last: {now.latest_drop}'
    return DiagnosticStatus.OK, f'{now.latest_people} people in the latest frame'


def _values(
    now: Snapshot, pairer: FramePairer[Any], reports: Sequence[TopicReport]
) -> Iterable[tuple[str, str]]:
    pairs = pairer.statistics
    yield 'pairs', str(now.pairs)
    yield 'frames', str(now.frames)
    yield 'pending', str(now.pending)
    yield 'people', str(now.people)
    yield MISSED, str(pairs.missed)
    if pairs.missed:
        yield WHY_MISSED, explain_refused_pairs(pairer)
    if pairs.skews_ns:
        skew_ms = np.abs(np.array(pairs.skews_ns)) / 1e6
        yield 'pair skew', percentiles(skew_ms.tolist())
    for reason, count in sorted(now.drops.items()):
        yield f'{DROP_PREFIX}{reason}', str(count)
    yield 'latency (pair to published)', percentiles(now.latency_ms)
    yield 'age of the image when published', percentiles(now.age_ms)
    for step, values_ms in now.step_ms.items():
        yield f'step {step}', percentiles(values_ms)
    for report in reports:
        yield f'{RECEIVED}{report.role}', str(report.count)
        yield report.role, report.text()
