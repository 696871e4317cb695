"""Open the bags of a replay, choose how to run it, and show its progress."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from pop_ros.bag_merge import BagPart, MergedBags
from pop_ros.bag_topics import RgbdTopics, find_topics
from pop_ros.bag_writer import BagWriter
from pop_ros.frame_fitter import FrameFitter
from pop_ros.keypoint_sources import reasons
from pop_ros.model_files import PACKAGED, ModelFiles
from pop_ros.node_arguments import NodeArguments, SourceArguments
from pop_ros.recording import Recording
from pop_ros.replay import ReplaySummary, replay_every_frame
from pop_ros.replay_dds import READY_S, DdsPlayer, bag_transports
from pop_ros.replay_inputs import CopiedInputs
from pop_ros.replay_node import NodeProcess
from pop_ros.replay_pace import Pace
from pop_ros.replay_settings import ReplaySettings

RUNNING_NODE_S = 30.0
STEP_KEYS = 'Enter shows the next frame, Ctrl-D plays on to the end, Ctrl-C ends'
LOOPING = '\nresults of this round are recorded; playing on until Ctrl-C'


@dataclass(frozen=True, slots=True)
class ReplayRequest:
    """What the user asked for.

    Args:
        bags: Bags to read as one.
        out: New rosbag2 folder.
        ros1: New ROS 1 bag, or None.
        sources: Where keypoints come from.
        topics: Colour, depth and CameraInfo topics where the user named them.
        slop_s: Largest difference of stamps of a pair [s].
        every_frame: Whether to do without a node.
        node_running: Whether to feed a node that runs already.
        pace: How the node is fed.
        part: Part of the recording to replay.
        storage: Storage of the rosbag2: 'mcap' or 'sqlite3'.
        inputs: Whether to copy the camera's messages and the transforms into the results.
        models: Files of body model and pose library.
        settings: Settings of the pipeline, and of the node.
    """

    bags: tuple[Path, ...]
    out: Path
    ros1: Path | None
    sources: SourceArguments
    topics: tuple[str | None, str | None, str | None]
    slop_s: float
    every_frame: bool = False
    node_running: bool = False
    pace: Pace = field(default_factory=Pace)
    part: BagPart = field(default_factory=BagPart)
    storage: str = 'mcap'
    inputs: bool = False
    models: ModelFiles = PACKAGED
    settings: ReplaySettings = field(default_factory=ReplaySettings)


def run_replay(request: ReplayRequest, say: Callable[[str], None]) -> ReplaySummary:
    """Replay a recording and return what came of it.

    Raises:
        PopError: If the bags, the topics, the keypoint source, the body, the library
            or the outputs do not allow it.
    """
    with MergedBags(request.bags, request.part) as bag:
        topics = find_topics(bag, *request.topics)
        say(f'color {topics.color}\ndepth {topics.depth}\ninfo  {topics.info}')
        for name in bag.unused(topics.all):
            say(f'{name}: has none of these topics and is not used')
        with Progress(
            TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), console=Console(stderr=True),
        ) as bar:
            task = bar.add_task('preparing', total=_message_count(request, bag, topics))

            def on_message() -> None:
                bar.update(task, description='messages', advance=1)

            if request.every_frame:
                return _every_frame(request, bag, topics, on_message, say)
            return _over_dds(request, bag, topics, on_message, say)


def _message_count(
    request: ReplayRequest, bag: Recording, topics: RgbdTopics
) -> int | None:
    """Return how many messages will be read, None where only reading them tells."""
    if not request.part.is_all:
        return None
    return sum(topic.count for topic in bag.topics if topic.name in topics.all)


def _every_frame(
    request: ReplayRequest, bag: Recording, topics: RgbdTopics, on_message: Callable[[], None],
    say: Callable[[str], None],
) -> ReplaySummary:
    writer = BagWriter(request.out, request.ros1, request.storage)
    detector = request.sources.detector()
    for reason in reasons(detector):
        say(reason)
    fitter = FrameFitter(
        detector, request.settings.pipeline, request.settings.node, models=request.models)
    with writer:
        return replay_every_frame(
            _read(request, bag, topics, writer), topics, fitter, writer, slop_s=request.slop_s,
            on_message=on_message)


def _read(
    request: ReplayRequest, bag: Recording, topics: RgbdTopics, writer: BagWriter
) -> Recording:
    """Return the recording to read from, which copies itself if that was asked for."""
    return CopiedInputs(bag, topics.all, writer) if request.inputs else bag


def _over_dds(
    request: ReplayRequest, bag: Recording, topics: RgbdTopics, on_message: Callable[[], None],
    say: Callable[[str], None],
) -> ReplaySummary:
    summary = ReplaySummary()
    writer = BagWriter(request.out, request.ros1, request.storage)
    if not request.node_running:
        # A source or a file that does not exist is refused here, before a node starts.
        request.sources.detector()
        request.models.check()
    node = None if request.node_running else NodeProcess(
        NodeArguments(request.sources, request.models), request.settings, request.slop_s,
        use_sim_time=request.pace.clock)
    check = (lambda: None) if node is None else node.check
    try:
        with DdsPlayer(bag_transports(bag, topics), check, request.pace) as player:
            player.wait_until_subscribed(RUNNING_NODE_S if node is None else READY_S)
            if request.pace.step:
                say(STEP_KEYS)
            # Nothing is left behind on the disk when the node does not come up.
            with writer:
                player.record_into(writer)
                source = _read(request, bag, topics, writer)
                _play_and_record(player, source, topics, summary, on_message)
            if request.pace.loop and not summary.interrupted:
                say(summary.text() + LOOPING)
                _loop(player, bag, topics)
    finally:
        code = 0 if node is None else node.stop()
    if code:
        summary.notes.append(f'the node ended with exit code {code}')
    return summary


def _play_and_record(
    player: DdsPlayer, bag: Recording, topics: RgbdTopics, summary: ReplaySummary,
    on_message: Callable[[], None],
) -> None:
    """Play a recording once, up to its end or Ctrl-C, and take over what the node counted."""
    try:
        player.play(bag, topics, on_message)
    except KeyboardInterrupt:
        summary.interrupted = True
    summary.messages = player.published
    player.finish(summary)
    player.stop_recording()
    summary.add_damage(bag)


def _loop(player: DdsPlayer, bag: Recording, topics: RgbdTopics) -> None:
    """Play a recording again and again until Ctrl-C."""
    with suppress(KeyboardInterrupt):
        while True:
            player.play(bag, topics, lambda: None)
