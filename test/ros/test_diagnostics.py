"""/diagnostics says how the node is, in the order of how much it matters."""

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from pop_core.errors import PopError
from pop_core.estimate import EstimateStatus
from pop_ros.diagnostics import Report, diagnostic_array, percentiles, read_values
from pop_ros.explanation import TopicReport
from pop_ros.message_error import BadMessageError
from pop_ros.node_config import DiagnosticsConfig
from pop_ros.pairing import FramePairer
from pop_ros.statistics import NodeStatistics, Snapshot, drop_reason
from pop_ros.to_messages import make_header

COLOR = TopicReport('color/image', '/color/image', ('camera (reliable)',), 9, 30.0, 1_500_000_000)
LIMITS = DiagnosticsConfig()


def status(
    statistics: NodeStatistics, before: Snapshot | None = None,
    pairer: FramePairer[int] | None = None, limits: DiagnosticsConfig = LIMITS, **state: object,
) -> tuple[bytes, str, dict[str, str]]:
    """Return level, sentence and values."""
    report = Report(
        statistics.snapshot(), before, pairer or FramePairer(0), [COLOR], limits, **state)
    message = diagnostic_array(make_header(0, ''), '/pop', report)
    values = read_values(message, '/pop')
    assert values is not None
    return message.status[0].level, message.status[0].message, values


def fitted(count: int = 1, age_ms: float = 120.0) -> NodeStatistics:
    statistics = NodeStatistics()
    for _ in range(count):
        statistics.add_pair()
        statistics.add_frame(1, 100.0, age_ms, {'fit': 90.0})
    return statistics


def test_reasons_are_words() -> None:
    assert drop_reason(BadMessageError('x')) == 'bad message'
    assert drop_reason(PopError('x')) == 'pop'
    assert drop_reason(ZeroDivisionError('x')) == 'zero division'


def test_the_same_drop_is_said_once_and_another_kind_at_once() -> None:
    statistics = NodeStatistics()
    assert statistics.add_refusal('no keypoints', 'no file 123.json')
    assert not statistics.add_refusal('no keypoints', 'no file 456.json')
    assert statistics.add_refusal('no keypoints', 'folder vanished')
    assert statistics.snapshot().drops == {'no keypoints': 3}


def test_pending_is_what_was_neither_fitted_nor_dropped() -> None:
    statistics = NodeStatistics()
    for _ in range(6):
        statistics.add_pair()
    statistics.add_refusal('bad message', 'x')
    statistics.add_drop('replaced by a newer pair')
    statistics.add_frame(2, 100.0, 120.0, {'fit': 90.0})
    snapshot = statistics.snapshot()
    assert snapshot.pending == 3
    assert snapshot.people == 2


def test_a_healthy_node_reports_every_count_and_time() -> None:
    level, text, values = status(fitted())
    assert (level, text) == (DiagnosticStatus.OK, '1 people in the latest frame')
    assert values['frames'] == '1'
    assert values['state'] == 'active'
    assert values['step fit'] == 'p50 90.0 ms, p95 90.0 ms'
    assert values['received color/image'] == '9'
    assert status(fitted(), doing='loading')[:2] == (DiagnosticStatus.OK, 'preparing: loading')
    assert 'idle' in status(fitted(), state='inactive', waits=False)[1]


def test_who_was_seen_and_not_fitted_is_counted_with_the_reason() -> None:
    statistics = fitted()
    for status_there in (EstimateStatus.OK, EstimateStatus.WAITING, EstimateStatus.TOO_FAR):
        statistics.add_frame(0, 1.0, 1.0, {}, [status_there, EstimateStatus.NO_SKELETON])
    _, _, values = status(statistics)
    assert {key: value for key, value in values.items() if key.startswith('not fitted')} == {
        f'not fitted: {EstimateStatus.TOO_FAR.value}': '1',
        f'not fitted: {EstimateStatus.NO_SKELETON.value}': '3'}


def test_pairs_with_faults_are_worth_a_warning_and_those_replaced_are_not() -> None:
    statistics = fitted()
    for _ in range(30):
        statistics.add_drop('replaced by a newer pair')
    assert status(statistics)[0] == DiagnosticStatus.OK
    for _ in range(3):
        statistics.add_refusal('bad message', 'expected 3 rows')
    level, text, values = status(statistics)
    assert level == DiagnosticStatus.WARN
    assert text == '3 of 4 pairs dropped, last: expected 3 rows'
    assert values['dropped: bad message'] == '3'
    # What was told once is over when the next report finds nothing new.
    assert status(statistics, before=statistics.snapshot())[0] == DiagnosticStatus.OK


def test_a_fault_of_the_node_is_an_error_and_comes_first() -> None:
    statistics = fitted()
    statistics.add_refusal('zero division', 'division by zero', is_fault=True)
    level, text, _ = status(statistics, troubles=['no camera\n  more'])
    assert level == DiagnosticStatus.ERROR
    assert text == '1 frames failed by a fault of the node: division by zero'


def test_troubles_are_told_by_their_first_lines() -> None:
    assert status(fitted(), troubles=['no camera\n  more', 'no keypoints'])[:2] == (
        DiagnosticStatus.WARN, 'no camera; no keypoints')


@pytest.mark.parametrize(('limits', 'age_ms', 'told'), [
    (DiagnosticsConfig(max_age_s=0.1), 120.0, 'images are 0.12 s old'),
    (DiagnosticsConfig(max_age_s=0.2), 120.0, ''),
    (DiagnosticsConfig(max_age_s=0.0), 120.0, ''),
    # A recording without simulated time: the stamps are years old.
    (DiagnosticsConfig(max_age_s=0.1), 1e12, ''),
    (DiagnosticsConfig(min_rate_hz=5.0), 120.0, '0.0 Hz, expected 5 Hz at least'),
])
def test_limits_decide_what_deserves_a_warning(
    limits: DiagnosticsConfig, age_ms: float, told: str
) -> None:
    statistics = fitted(age_ms=age_ms)
    level, text, _ = status(statistics, before=statistics.snapshot(), limits=limits)
    assert (level == DiagnosticStatus.WARN) == bool(told)
    assert told in text


def test_no_rate_is_expected_while_nobody_listens() -> None:
    limits = DiagnosticsConfig(min_rate_hz=5.0)
    statistics = fitted()
    before = statistics.snapshot()
    assert status(statistics, before=before, limits=limits, waits=False)[0] == DiagnosticStatus.OK


def test_streams_far_apart_deserve_a_warning() -> None:
    pairer: FramePairer[int] = FramePairer(50_000_000)
    pairer.add_color(0, 0, 0)
    pairer.add_depth(40_000_000, 0, 0)
    assert len(pairer.flush()) == 1
    level, text, _ = status(fitted(), pairer=pairer)
    assert level == DiagnosticStatus.WARN
    assert 'colour and depth are 0.040 s apart' in text


def test_values_of_another_status_are_not_ours() -> None:
    report = Report(NodeStatistics().snapshot(), None, FramePairer[int](0), [], LIMITS)
    assert read_values(diagnostic_array(make_header(0, ''), '/other', report), '/pop') is None


def test_percentiles_of_nothing_are_a_dash() -> None:
    assert percentiles([]) == '-'
