"""Explanations name the cause, the numbers and what to do."""

from pop_ros.explanation import (
    TopicReport,
    explain_missing_pairs,
    explain_refused_pairs,
    round_up,
)
from pop_ros.pairing import FramePairer

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
