"""Explanations name the cause, the numbers and what to do."""

from pop_core.errors import PopError
from pop_ros.diagnostics import diagnostic_array, percentiles, read_values
from pop_ros.explanation import (
    TopicReport,
    explain_missing_pairs,
    explain_refused_pairs,
    round_up,
)
from pop_ros.from_messages import BadMessageError
from pop_ros.pairing import FramePairer
from pop_ros.statistics import NodeStatistics, drop_reason
from pop_ros.to_messages import make_header

MS = 1_000_000


def report(role: str, *, offers: tuple[str, ...] = ('camera (reliable)',), count: int = 9,
           others: tuple[str, ...] = ()) -> TopicReport:
    return TopicReport(role, f'/{role}', offers, count, 30.0, 1_500_000_000, others)


def test_a_topic_without_publisher_comes_before_every_other_cause() -> None:
    reports = [report('color/image'), report('depth/image', offers=(), count=0,
                                             others=('/cam/depth',))]
    text = explain_missing_pairs(reports, FramePairer[int](0), 5)
    assert 'depth/image has no publisher; remap it, as in -r depth/image:=/cam/depth' in text


def test_a_silent_topic_is_named_with_what_its_publisher_offers() -> None:
    silent = report('color/camera_info', offers=('driver (best effort)',), count=0)
    text = explain_missing_pairs([report('color/image'), silent], FramePairer[int](0), 5)
    assert 'nothing arrives on color/camera_info' in text
    assert 'offered by driver (best effort), but no message arrived' in text


def test_arriving_topics_are_told_with_rate_and_stamp() -> None:
    text = report('color/image').text()
    assert '30.0 Hz, 9 messages, last stamp 1.500 s' in text


def refusal(colors_ms: list[int], depths_ms: list[int]) -> str:
    """Return the explanation after these stamps with a slop of 20 ms."""
    pairer: FramePairer[int] = FramePairer(20 * MS)
    for stamp in depths_ms:
        pairer.add_depth(stamp * MS, 0, 0)
    for stamp in colors_ms:
        pairer.add_color(stamp * MS, 0, 0)
    pairer.flush()
    return explain_refused_pairs(pairer)


def test_missing_slow_and_far_depth_are_told_apart() -> None:
    assert 'no depth image at all' in refusal([0, 33], [])
    assert 'depth comes at a lower rate' in refusal([0, 15], [2])
    assert '0.336 s away' in refusal([0], [336])
    assert 'slop 0.4' in refusal([0], [336])


def test_suggested_slops_are_round_and_large_enough() -> None:
    for seconds in (0.003, 0.031, 0.0999, 0.113, 0.2, 0.336, 1.04):
        assert seconds < round_up(seconds) <= seconds + 0.1 + 1e-9


def test_reasons_are_words() -> None:
    assert drop_reason(BadMessageError('x')) == 'bad message'
    assert drop_reason(PopError('x')) == 'pop'
    assert drop_reason(ZeroDivisionError('x')) == 'zero division'


def test_the_same_drop_is_said_once_and_another_kind_at_once() -> None:
    statistics = NodeStatistics()
    assert statistics.add_drop('no keypoints', 'no file 123.json')
    assert not statistics.add_drop('no keypoints', 'no file 456.json')
    assert statistics.add_drop('no keypoints', 'folder vanished')
    assert statistics.snapshot().drops == {'no keypoints': 3}


def test_pending_is_what_was_neither_fitted_nor_dropped() -> None:
    statistics = NodeStatistics()
    for _ in range(5):
        statistics.add_pair()
    statistics.add_drop('bad message', 'x')
    statistics.add_frame(2, 100.0, 120.0, {'fit': 90.0})
    snapshot = statistics.snapshot()
    assert snapshot.pending == 3
    assert snapshot.people == 2


def test_diagnostics_warn_when_most_pairs_are_dropped_and_carry_all_counts() -> None:
    statistics = NodeStatistics()
    pairer: FramePairer[int] = FramePairer(0)

    def status(trouble: str = '') -> tuple[bytes, str, dict[str, str]]:
        message = diagnostic_array(
            make_header(0, ''), '/pop', statistics.snapshot(), previous=None, pairer=pairer,
            reports=[report('color/image')], trouble=trouble)
        values = read_values(message, '/pop')
        assert values is not None
        return message.status[0].level, message.status[0].message, values

    statistics.add_pair()
    statistics.add_frame(1, 100.0, 120.0, {'fit': 90.0})
    level, text, values = status()
    assert (level, text) == (b'\0', '1 people in the latest frame')
    assert values['frames'] == '1'
    assert values['step fit'] == 'p50 90.0 ms, p95 90.0 ms'
    assert values['received color/image'] == '9'
    for _ in range(3):
        statistics.add_drop('bad message', 'expected 3 rows')
    level, text, values = status()
    assert level == b'\1'
    assert 'expected 3 rows' in text
    assert values['dropped: bad message'] == '3'
    assert status('no camera\n  more')[:2] == (b'\1', 'no camera')


def test_values_of_another_status_are_not_ours() -> None:
    message = diagnostic_array(
        make_header(0, ''), '/other', NodeStatistics().snapshot(), previous=None,
        pairer=FramePairer[int](0), reports=[], trouble='')
    assert read_values(message, '/pop') is None


def test_percentiles_of_nothing_are_a_dash() -> None:
    assert percentiles([]) == '-'
