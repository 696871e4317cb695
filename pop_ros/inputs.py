"""The three inputs of the node: subscribed as offered, paired, handed on with the CameraInfo."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from pop_ros.explanation import TopicReport
from pop_ros.from_messages import stamp_ns
from pop_ros.pairing import FramePairer, Pair
from pop_ros.qos import describe_qos, matched_qos, same_qos

COLOR, DEPTH, INFO = 'color/image', 'depth/image', 'color/camera_info'
DEPTH_INFO = 'depth/camera_info'  # only for depth in a frame of its own
# Where a role's messages come from, best first; suffixes are those of image_transport.
TRANSPORTS: Mapping[str, Sequence[tuple[str, type]]] = {
    COLOR: (('', Image), ('/compressed', CompressedImage)),
    DEPTH: (('', Image), ('/compressedDepth', CompressedImage)),
    INFO: (('', CameraInfo),),
    DEPTH_INFO: (('', CameraInfo),),
}
LATCHED = (INFO, DEPTH_INFO)


@dataclass(frozen=True, slots=True, eq=False)
class RgbdMessages:
    """The messages of one frame.

    Args:
        color: sensor_msgs/Image or CompressedImage of colour.
        depth: sensor_msgs/Image or CompressedImage of depth.
        info: sensor_msgs/CameraInfo of the colour camera.
        arrival_s: Steady time at which the pair was complete [s].
        depth_info: sensor_msgs/CameraInfo of the depth camera, or None.
        number: Counts the pairs, so that whoever takes one knows how many they left out.
    """

    color: Any
    depth: Any
    info: CameraInfo
    arrival_s: float
    depth_info: CameraInfo | None = None
    number: int = 0


class InputTopic:
    """One input whose subscription follows who publishes it, and what they offer."""

    def __init__(self, node: Node, role: str, on_message: Callable[[Any], None]) -> None:
        """Prepare the input `role` (relative name), not subscribed yet."""
        self.role, self.topic = role, node.resolve_topic_name(role)
        self._node, self._on_message = node, on_message
        self._subscription: Subscription | None = None
        self._subscribed: tuple[str, QoSProfile] | None = None
        self._count = self._counted = 0
        self._counted_at = time.monotonic()
        self._last_stamp_ns: int | None = None

    def follow(self, reliability: str) -> None:
        """Subscribe as the present publishers offer; change it when they change."""
        topic, kind, offers = self._published()
        if not offers:
            return
        profile = matched_qos(
            [o.qos_profile for o in offers], latched=self.role in LATCHED, reliability=reliability)
        if self._subscribed is not None:
            before, present = self._subscribed
            if before == topic and same_qos(profile, present):
                return
        self.leave()
        self._subscribed = (topic, profile)
        self._subscription = self._node.create_subscription(kind, topic, self._receive, profile)
        log = self._node.get_logger()  # type: ignore[no-untyped-call]
        log.info(f'{self.role}: subscribed {topic} ({describe_qos(profile)})')

    def leave(self) -> None:
        """Unsubscribe."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._subscription = self._subscribed = None

    def report(self) -> TopicReport:
        """Return counts and offers; the rate is that since the report before."""
        now = time.monotonic()
        rate_hz = (self._count - self._counted) / max(now - self._counted_at, 1e-3)
        self._counted, self._counted_at = self._count, now
        topic, kind, offers = self._published()
        texts = tuple(f'{o.node_name} ({describe_qos(o.qos_profile)})' for o in offers)
        others = () if texts else self._same_type(kind)
        asked = '' if self._subscribed is None else describe_qos(self._subscribed[1])
        return TopicReport(
            self.role, topic, texts, self._count, rate_hz, self._last_stamp_ns, others, asked)

    def _published(self) -> tuple[str, type, Sequence[TopicEndpointInfo]]:
        """Return the best transport that is published: topic, type and its publishers."""
        for suffix, kind in TRANSPORTS[self.role]:
            topic = f'{self.topic}{suffix}'
            offers = self._node.get_publishers_info_by_topic(topic)
            if offers:
                return topic, kind, offers
        return self.topic, TRANSPORTS[self.role][0][1], ()

    def _same_type(self, kind: type) -> tuple[str, ...]:
        name = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
        known = self._node.get_topic_names_and_types()
        own = f'{self._node.get_fully_qualified_name()}/'
        same = [topic for topic, types in known
                if name in types and not topic.startswith(own)
                and self._node.count_publishers(topic)]
        wants_depth = 'depth' in self.role
        return tuple(sorted(same, key=lambda topic: ('depth' in topic) != wants_depth))

    def _receive(self, message: Any) -> None:
        self._count += 1
        self._last_stamp_ns = stamp_ns(message.header)
        self._on_message(message)


class RgbdInputs:
    """Pairs colour and depth and adds the latest CameraInfo, however it is published."""

    def __init__(
        self, node: Node, slop_s: float, on_frame: Callable[[RgbdMessages], None]
    ) -> None:
        """Prepare the inputs; nothing is subscribed before `follow`."""
        self.pairer: FramePairer[Any] = FramePairer(round(slop_s * 1e9))
        self._on_frame = on_frame
        self._info: CameraInfo | None = None
        self._depth_info: CameraInfo | None = None
        self._without_info: Pair[Any] | None = None
        self._number = 0
        self.last_frame_s = time.monotonic()
        self._following = False
        self.topics = (
            InputTopic(node, COLOR, self._on_color),
            InputTopic(node, DEPTH, self._on_depth),
            InputTopic(node, INFO, self._on_info),
            InputTopic(node, DEPTH_INFO, self._on_depth_info),
        )

    def follow(self, reliability: str) -> None:
        """Subscribe what is published."""
        if not self._following:
            # Silence counts from here: a node may have loaded its library for a minute before.
            self._following, self.last_frame_s = True, time.monotonic()
        for topic in self.topics:
            topic.follow(reliability)

    def leave(self) -> None:
        """Unsubscribe everything; what comes next may be another camera."""
        self._following = False
        for topic in self.topics:
            topic.leave()
        self._info = self._depth_info = None
        self.reset(self.pairer.slop_ns / 1e9)

    def reset(self, slop_s: float) -> None:
        """Start pairing anew; the CameraInfo and the counts stay."""
        self.pairer = FramePairer(round(slop_s * 1e9), self.pairer.statistics)
        self._without_info = None
        self.last_frame_s = time.monotonic()

    def poll(self) -> None:
        """Hand on pairs that have waited long enough."""
        self._hand_on(self.pairer.poll(time.monotonic_ns()))

    def reports(self) -> list[TopicReport]:
        """Return the state of the topics; that of the optional one only where it is published."""
        reports = [topic.report() for topic in self.topics]
        return [report for report in reports if report.role != DEPTH_INFO or report.offers]

    def _on_color(self, message: Any) -> None:
        now_ns = time.monotonic_ns()
        self._hand_on(self.pairer.add_color(stamp_ns(message.header), message, now_ns))

    def _on_depth(self, message: Any) -> None:
        now_ns = time.monotonic_ns()
        self._hand_on(self.pairer.add_depth(stamp_ns(message.header), message, now_ns))

    def _on_info(self, message: CameraInfo) -> None:
        self._info = message
        if self._without_info is not None:
            pair, self._without_info = self._without_info, None
            self._hand_on([pair])

    def _on_depth_info(self, message: CameraInfo) -> None:
        self._depth_info = message

    def _hand_on(self, pairs: list[Pair[Any]]) -> None:
        for pair in pairs:
            if self._info is None:
                self._without_info = pair
                continue
            self.last_frame_s = time.monotonic()
            self._number += 1
            self._on_frame(RgbdMessages(
                pair.color, pair.depth, self._info, self.last_frame_s, self._depth_info,
                self._number))
