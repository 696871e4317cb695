"""Fit every frame of a bag, without a node and without dropping any."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from rclpy.serialization import serialize_message

from pop_core.errors import PopError
from pop_ros.bag_reader import BagMessage
from pop_ros.bag_topics import RgbdTopics
from pop_ros.bag_writer import BagWriter
from pop_ros.body_messages import RECORDED_TYPES
from pop_ros.diagnostics import MISSED, percentiles
from pop_ros.explanation import explain_refused_pairs
from pop_ros.frame_fitter import FrameFitter
from pop_ros.from_messages import stamp_ns
from pop_ros.pairing import FramePairer
from pop_ros.plain_cdr import with_zero_padding
from pop_ros.recording import Recording
from pop_ros.statistics import drop_reason

OUTPUT_NAMESPACE = '/pop'
INTERRUPTED = 'ended by Ctrl-C; the results up to then are recorded'
KINDS = {name: f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
         for name, kind in RECORDED_TYPES.items()}


@dataclass(slots=True)
class ReplaySummary:
    """What a replay did.

    Args:
        messages: Messages read from the bag.
        pairs: Pairs of colour and depth.
        frames: Frames fitted.
        people: People in all frames.
        drops: Pairs that gave no frame, by reason.
        latency_ms: Time per frame, or the node's own words about it.
        notes: What else the user must know.
        interrupted: Whether the user ended it with Ctrl-C.
    """

    messages: int = 0
    pairs: int = 0
    frames: int = 0
    people: int = 0
    drops: Counter[str] = field(default_factory=Counter)
    latency_ms: list[float] = field(default_factory=list)
    latency_text: str = ''
    notes: list[str] = field(default_factory=list)
    interrupted: bool = False

    def add_drop(self, error: PopError) -> None:
        """Count a pair that gave no frame; the first of its kind is told in full."""
        reason = drop_reason(error)
        self.drops[reason] += 1
        if self.drops[reason] == 1:
            self.notes.append(f'{reason}: {error}')

    def add_damage(self, bag: Recording) -> None:
        """Note what was wrong with a bag that has been read."""
        if bag.damage:
            self.notes.append(
                f'the bag is damaged ({bag.damage}); what could be read was processed')

    def text(self) -> str:
        """Return the summary in lines."""
        latency = self.latency_text or percentiles(self.latency_ms)
        lines = [
            f'{self.frames} frames fitted of {self.pairs} pairs ({self.messages} messages), '
            f'{self.people} people, per frame {latency}']
        lines += [f'dropped {count}: {reason}' for reason, count in self.drops.most_common()]
        ended = [INTERRUPTED] if self.interrupted else []
        return '\n'.join(lines + self.notes + ended)


@dataclass(frozen=True, slots=True, eq=False)
class BagFrame:
    """The stored messages of one frame.

    Args:
        color: Colour image.
        depth: Depth image.
        info: CameraInfo that was the latest at that time.
    """

    color: BagMessage
    depth: BagMessage
    info: BagMessage


def paired_frames(
    bag: Recording, topics: RgbdTopics, pairer: FramePairer[BagMessage],
    on_message: Callable[[], None],
) -> Iterator[BagFrame]:
    """Yield the frames of a bag in the order their pairs are complete."""
    info = bag.first(topics.info)
    if info is None:
        return
    for message in bag.messages(topics.all):
        on_message()
        # Where recording stopped for a while, what has waited belongs to the time before.
        for pair in pairer.poll(message.time_ns):
            yield BagFrame(pair.color, pair.depth, info)
        if message.topic == topics.info:
            info = message
            continue
        add = pairer.add_color if message.topic == topics.color else pairer.add_depth
        for pair in add(stamp_ns(message.read().header), message, message.time_ns):
            yield BagFrame(pair.color, pair.depth, info)
    for pair in pairer.flush():
        yield BagFrame(pair.color, pair.depth, info)


def replay_every_frame(
    bag: Recording,
    topics: RgbdTopics,
    fitter: FrameFitter,
    writer: BagWriter,
    *,
    slop_s: float,
    on_message: Callable[[], None],
) -> ReplaySummary:
    """Fit every pair of a bag and write the results with the stamps of their images.

    Args:
        bag: Open bag to read.
        topics: Its RGB-D topics.
        fitter: Pipeline with messages on both sides.
        writer: Open bag to write.
        slop_s: Largest difference of stamps of a pair [s].
        on_message: Called after every message read.
    """
    summary = ReplaySummary()
    pairer: FramePairer[BagMessage] = FramePairer(round(slop_s * 1e9))
    announce_outputs(writer)

    def count() -> None:
        summary.messages += 1
        on_message()

    try:
        for frame in paired_frames(bag, topics, pairer, count):
            _process(frame, fitter, writer, summary)
    except KeyboardInterrupt:
        summary.interrupted = True
    if pairer.statistics.missed:
        summary.notes.append(
            f'{pairer.statistics.missed} {MISSED}: {explain_refused_pairs(pairer)}')
    summary.add_damage(bag)
    return summary


def announce_outputs(writer: BagWriter) -> None:
    """Create the output topics, so that a bag without people has them too."""
    for name, kind in KINDS.items():
        writer.add_topic(f'{OUTPUT_NAMESPACE}/{name}', kind)


def _process(
    frame: BagFrame, fitter: FrameFitter, writer: BagWriter, summary: ReplaySummary
) -> None:
    """Fit a frame, write its results and count it, or the reason why there are none."""
    summary.pairs += 1
    started_s = time.perf_counter()
    try:
        _fit_and_write(frame, fitter, writer, summary)
    except PopError as error:
        summary.add_drop(error)
    else:
        summary.frames += 1
        summary.latency_ms.append((time.perf_counter() - started_s) * 1e3)


def _fit_and_write(
    frame: BagFrame, fitter: FrameFitter, writer: BagWriter, summary: ReplaySummary
) -> None:
    color = frame.color.read()
    fitted = fitter.fit(color, frame.depth.read(), frame.info.read())
    summary.people += len(fitted.result.bodies)
    for name, message in fitted.outputs:
        # The same frames give the same bytes, so that results can be compared as files.
        data = message if isinstance(message, bytes) else with_zero_padding(
            bytes(serialize_message(message)), KINDS[name])
        writer.write(f'{OUTPUT_NAMESPACE}/{name}', KINDS[name], frame.color.time_ns, data)
