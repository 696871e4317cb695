"""The node's health as diagnostic_msgs/DiagnosticArray."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from pop_ros.explanation import TopicReport, explain_refused_pairs
from pop_ros.node_config import DiagnosticsConfig
from pop_ros.pairing import FramePairer
from pop_ros.statistics import Snapshot

DROP_PREFIX = 'dropped: '
UNFITTED_PREFIX = 'not fitted: '
RECEIVED = 'received '
MISSED = 'colour images without depth'
WHY_MISSED = 'why without depth'
AGE_OF_RECORDINGS_S = 3600.0


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """What is known when /diagnostics is due.

    Args:
        now: Counts now.
        before: Counts at the report before, or None.
        pairer: Pairer of the inputs, for its counts.
        topics: State of the inputs.
        limits: Values that deserve a warning.
        state: State of the life cycle.
        doing: What is being prepared; '' when nothing is.
        waits: Whether frames are expected.
        troubles: What keeps the node from working; the first line of each says it.
    """

    now: Snapshot
    before: Snapshot | None
    pairer: FramePairer[Any]
    topics: Sequence[TopicReport]
    limits: DiagnosticsConfig
    state: str = 'active'
    doing: str = ''
    waits: bool = True
    troubles: Sequence[str] = ()

    @property
    def rate_hz(self) -> float:
        """Return the frames fitted per second since the report before."""
        if self.before is None:
            return 0.0
        seconds = self.now.taken_s - self.before.taken_s
        return (self.now.frames - self.before.frames) / seconds if seconds > 0 else 0.0

    def new(self, count: Callable[[Snapshot], int]) -> int:
        """Return what a count has grown by since the report before."""
        return count(self.now) - (count(self.before) if self.before is not None else 0)


def diagnostic_array(header: Header, name: str, report: Report) -> DiagnosticArray:
    """Return one status: level and sentence first, all counts and times as values.

    Args:
        header: Stamp of the report.
        name: Name of the status.
        report: What is known.
    """
    level, message = _judge(report)
    values = [KeyValue(key=key, value=value) for key, value in _values(report)]
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


def _judge(report: Report) -> tuple[bytes, str]:
    """Return the worst level that is deserved, and in words what deserves it."""
    faults = report.new(lambda s: s.faults)
    if faults:
        return DiagnosticStatus.ERROR, (
            f'{faults} frames failed by a fault of the node: {report.now.latest_drop}')
    if report.troubles:
        return DiagnosticStatus.WARN, '; '.join(
            trouble.splitlines()[0] for trouble in report.troubles)
    warnings = list(_warnings(report))
    if warnings:
        return DiagnosticStatus.WARN, '; '.join(warnings)
    if report.doing:
        return DiagnosticStatus.OK, f'preparing: {report.doing}'
    if not report.waits:
        return DiagnosticStatus.OK, f'{report.state}, idle: nobody listens, or it is disabled'
    return DiagnosticStatus.OK, f'{report.now.latest_people} people in the latest frame'


def _warnings(report: Report) -> Iterator[str]:
    limits, now = report.limits, report.now
    drops = report.new(lambda s: s.refused)
    handled = drops + report.new(lambda s: s.frames)
    if limits.max_drops and drops > limits.max_drops * handled:
        yield f'{drops} of {handled} pairs dropped, last: {now.latest_drop}'
    if report.waits and report.before is not None and report.rate_hz < limits.min_rate_hz:
        yield f'{report.rate_hz:.1f} Hz, expected {limits.min_rate_hz:g} Hz at least'
    age_s = float(np.median(now.age_ms)) / 1e3 if now.age_ms else 0.0
    # Images a recorded hour old or stamped in the future say nothing of this node's haste.
    if limits.max_age_s and limits.max_age_s < age_s < AGE_OF_RECORDINGS_S:
        yield f'images are {age_s:.2f} s old when published, expected {limits.max_age_s:g} s'
    skews_ns = report.pairer.statistics.skews_ns
    skew_s = float(np.median(np.abs(skews_ns))) / 1e9 if skews_ns else 0.0
    if limits.max_skew_s and skew_s > limits.max_skew_s:
        yield (f'colour and depth are {skew_s:.3f} s apart, expected {limits.max_skew_s:g} s: '
               'synchronise the streams')


def _values(report: Report) -> Iterator[tuple[str, str]]:
    now, pairs = report.now, report.pairer.statistics
    yield 'state', report.state
    yield 'pairs', str(now.pairs)
    yield 'frames', str(now.frames)
    yield 'rate', f'{report.rate_hz:.1f} Hz'
    yield 'pending', str(now.pending)
    yield 'people', str(now.people)
    for reason, count in sorted(now.unfitted.items()):
        yield f'{UNFITTED_PREFIX}{reason}', str(count)
    yield MISSED, str(pairs.missed)
    if pairs.missed:
        yield WHY_MISSED, explain_refused_pairs(report.pairer)
    if pairs.skews_ns:
        skew_ms = np.abs(np.array(pairs.skews_ns)) / 1e6
        yield 'pair skew', percentiles(skew_ms.tolist())
    for reason, count in sorted(now.drops.items()):
        yield f'{DROP_PREFIX}{reason}', str(count)
    yield 'latency (pair to published)', percentiles(now.latency_ms)
    yield 'age of the image when published', percentiles(now.age_ms)
    for step, values_ms in now.step_ms.items():
        yield f'step {step}', percentiles(values_ms)
    for topic in report.topics:
        yield f'{RECEIVED}{topic.role}', str(topic.count)
        yield topic.role, topic.text()
