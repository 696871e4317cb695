"""Say in words why nothing comes, of the camera or of the keypoint source.

Of a camera: which topic, at what rate, offered how, stamped when.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pop_ros.pairing import FramePairer, ItemT


@dataclass(frozen=True, slots=True)
class TopicReport:
    """What is known of one input.

    Args:
        role: Relative name, such as 'color/image'.
        topic: Resolved name.
        offers: One text per publisher: node name and quality of service.
        count: Messages received.
        rate_hz: Messages per second since the last report.
        last_stamp_ns: Stamp of the newest message [ns], or None.
        others: Topics of the same type that are published.
        asked: Quality of service asked for, as text; '' while not subscribed.
    """

    role: str
    topic: str
    offers: tuple[str, ...]
    count: int
    rate_hz: float
    last_stamp_ns: int | None
    others: tuple[str, ...] = ()
    asked: str = ''

    @property
    def is_refused(self) -> bool:
        """Return whether more is asked than some publisher offers, so that it sends nothing."""
        return self.asked.startswith('reliable') and any('best effort' in o for o in self.offers)

    def text(self) -> str:
        """Return one line about the topic."""
        if not self.offers:
            hint = f'; published with this type: {", ".join(self.others)}' if self.others else ''
            return f'{self.role}: nobody publishes {self.topic}{hint}'
        offered = ', '.join(self.offers)
        if not self.count:
            asked = f', asked for as {self.asked}' if self.asked else ''
            return (f'{self.role}: {self.topic} is offered by {offered}{asked}, but no message '
                    'arrived')
        stamp = '-' if self.last_stamp_ns is None else f'{self.last_stamp_ns / 1e9:.3f} s'
        return (f'{self.role}: {self.topic} {self.rate_hz:.1f} Hz, {self.count} messages, '
                f'last stamp {stamp}, offered by {offered}')


def explain_missing_pairs(
    reports: Sequence[TopicReport], pairer: FramePairer[ItemT], seconds: float
) -> str:
    """Return why no pair came for some seconds, with what to do about it."""
    lines = [f'no RGB-D frame for {seconds:.0f} s: {_cause(reports, pairer)}']
    return '\n  '.join([*lines, *(report.text() for report in reports)])


def explain_missing_keypoints(seconds: float) -> str:
    """Return what it means that the keypoint source has not answered for some seconds."""
    return (f'the keypoint source has not answered for {seconds:.0f} s: nobody new is found, and '
            'who is followed is followed without it; after 30 s its process is started anew')


def explain_refused_pairs(pairer: FramePairer[ItemT]) -> str:
    """Return why colour images stayed without depth, with what to do about it."""
    gap_ns, slop_s = pairer.statistics.missed_gap_ns, pairer.slop_ns / 1e9
    if gap_ns is None:
        return 'colour images arrive, but no depth image at all'
    if gap_ns <= pairer.slop_ns:
        return 'depth images belong to other colour images: depth comes at a lower rate'
    return (f'the nearest depth image is {gap_ns / 1e9:.3f} s away from its colour image, and '
            f'sync.slop_s accepts {slop_s:.3f} s: synchronise the streams, or accept it with '
            f'slop {round_up(gap_ns / 1e9):g} if the scene stands still')


def round_up(seconds: float) -> float:
    """Return a duration rounded up to two digits, for a text that suggests it."""
    step = 0.1 if seconds >= 0.1 else 0.01
    return round((int(seconds / step) + 1) * step, 2)


def _cause(reports: Sequence[TopicReport], pairer: FramePairer[ItemT]) -> str:
    unpublished = [r for r in reports if not r.offers]
    if unpublished:
        example = unpublished[0].others[0] if unpublished[0].others else '/your/topic'
        return (f'{unpublished[0].role} has no publisher; remap it, as in '
                f'-r {unpublished[0].role}:={example}')
    refused = [r.role for r in reports if not r.count and r.is_refused]
    if refused:
        return (f'{" and ".join(refused)}: reliable is asked of a best-effort publisher, which '
                'then sends nothing; set input.reliability to auto')
    silent = [r.role for r in reports if not r.count]
    if silent:
        return (f'nothing arrives on {" and ".join(silent)}; check that the driver streams and '
                'that both sides use the same RMW and domain')
    if pairer.statistics.missed:
        return explain_refused_pairs(pairer)
    return 'the streams have stopped'
