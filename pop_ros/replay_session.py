"""Open the bags of a replay, choose how to run it, and show its progress."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from pop_core.config import PipelineConfig
from pop_ros.bag_reader import BagReader
from pop_ros.bag_topics import RgbdTopics, find_topics
from pop_ros.bag_writer import BagWriter
from pop_ros.frame_fitter import FrameFitter
from pop_ros.node_arguments import SourceArguments
from pop_ros.node_config import NodeConfig
from pop_ros.replay import ReplaySummary, replay_every_frame
from pop_ros.replay_dds import READY_S, DdsPlayer, NodeProcess, bag_transports
from pop_ros.sources import make_detector

RUNNING_NODE_S = 30.0


@dataclass(frozen=True, slots=True)
class ReplayRequest:
    """What the user asked for.

    Args:
        bag: Bag to read.
        out: New rosbag2 folder.
        ros1: New ROS 1 bag, or None.
        sources: Where keypoints come from.
        topics: Colour, depth and CameraInfo topics where the user named them.
        slop_s: Largest difference of stamps of a pair [s].
        rate: Speed at which the node is fed.
        every_frame: Whether to do without a node.
        node_running: Whether to feed a node that runs already.
    """

    bag: Path
    out: Path
    ros1: Path | None
    sources: SourceArguments
    topics: tuple[str | None, str | None, str | None]
    slop_s: float
    rate: float
    every_frame: bool
    node_running: bool


def run_replay(request: ReplayRequest, say: Callable[[str], None]) -> ReplaySummary:
    """Replay a bag and return what came of it.

    Raises:
        PopError: If the bag, the topics, the keypoint source or the outputs do not allow it.
    """
    with BagReader(request.bag) as bag:
        topics = find_topics(bag, *request.topics)
        say(f'color {topics.color}\ndepth {topics.depth}\ninfo  {topics.info}')
        counts = {topic.name: topic.count for topic in bag.topics}
        total = sum(counts[name] for name in topics.all)
        with Progress(
            TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), console=Console(stderr=True),
        ) as bar:
            task = bar.add_task('preparing', total=total)

            def on_message() -> None:
                bar.update(task, description='messages', advance=1)

            run = _every_frame if request.every_frame else _over_dds
            return run(request, bag, topics, on_message)


def _every_frame(
    request: ReplayRequest, bag: BagReader, topics: RgbdTopics, on_message: Callable[[], None]
) -> ReplaySummary:
    writer = BagWriter(request.out, request.ros1)
    fitter = FrameFitter(request.sources, PipelineConfig(), NodeConfig())
    with writer:
        return replay_every_frame(
            bag, topics, fitter, writer, slop_s=request.slop_s, on_message=on_message)


def _over_dds(
    request: ReplayRequest, bag: BagReader, topics: RgbdTopics, on_message: Callable[[], None]
) -> ReplaySummary:
    summary = ReplaySummary()
    writer = BagWriter(request.out, request.ros1)
    if not request.node_running:
        # A source that does not exist is refused here, before a node starts.
        make_detector(*dataclasses.astuple(request.sources))
    node = None if request.node_running else NodeProcess(request.sources, request.slop_s)
    check = (lambda: None) if node is None else node.check
    try:
        with DdsPlayer(bag_transports(bag, topics), check) as player:
            player.wait_until_subscribed(RUNNING_NODE_S if node is None else READY_S)
            # Nothing is left behind on the disk when the node does not come up.
            with writer:
                player.record_into(writer)
                summary.messages = player.play(bag, topics, request.rate, on_message)
                player.finish(summary)
    finally:
        code = 0 if node is None else node.stop()
    if code:
        summary.notes.append(f'the node ended with exit code {code}')
    if bag.damage:
        summary.notes.append(
            f'the bag is damaged ({bag.damage}); what could be read was processed')
    return summary
