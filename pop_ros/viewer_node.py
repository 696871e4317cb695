"""The node `pop_viewer`: meshes for rviz on the machine that watches, from ~/bodies alone.

A mesh of 13,000 triangles is a megabyte per person and frame; the parameters that pose it are 340
bytes. The viewer holds the same body model and skins it where it is looked at.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.subscription import Subscription
from visualization_msgs.msg import Marker

from pop_core.body.model import BodyModel
from pop_core.errors import PopError
from pop_ros.body_rebuilder import BodyRebuilder
from pop_ros.from_messages import stamp_ns
from pop_ros.mesh_markers import MeshMarkers
from pop_ros.message_error import BadMessageError
from pop_ros.node_config import MeshConfig
from pop_ros.pop_messages import pop_msgs
from pop_ros.qos import matched_qos, output_qos

FOLLOW_S = 0.25
REPORT_S = 5.0
NO_MODEL = 'no body_model has come yet'
OTHER_MODEL = 'poses of another model'


class ViewerError(PopError):
    """Something the viewer cannot start without."""


class ViewerNode(Node):
    """Turns the bodies of one pop node into meshes, while somebody watches them."""

    def __init__(self, model: BodyModel, watched: str, config: MeshConfig) -> None:
        """Subscribe the model of a node.

        Args:
            model: Body model to skin; must be the node's.
            watched: Full name of the pop node.
            config: Detail and lifetime of meshes.

        Raises:
            ViewerError: If pop_msgs is not installed.
        """
        if pop_msgs is None:
            raise ViewerError(
                'expected the package pop_msgs, found none: build msg_defs with colcon, or with '
                'scripts/build_messages.sh')
        super().__init__('pop_viewer')
        self.log = self.get_logger()  # type: ignore[no-untyped-call]
        self._rebuilder = BodyRebuilder(model)
        self._markers = MeshMarkers(model, config)
        self._watched = watched
        self._fits: bool | None = None
        self._shown: set[int] = set()
        self._bodies: Subscription | None = None
        self._drops: Counter[str] = Counter()
        self._said_waiting = False
        self._publisher = self.create_publisher(Marker, '~/mesh', output_qos())
        self.create_subscription(
            pop_msgs.BodyModel, f'{watched}/body_model', self._on_model, output_qos(latched=True))
        # A simulated clock that stands still must not silence the node.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(FOLLOW_S, self._follow, clock=steady)
        self.create_timer(REPORT_S, self._report, clock=steady)

    def _on_model(self, message: Any) -> None:
        trouble = self._rebuilder.mismatch(message)
        self._fits = not trouble
        if trouble:
            self.log.error(trouble)
        else:
            self.log.info(f'{self._watched} poses {message.name!r} ({message.digest}), as here')

    def _follow(self) -> None:
        """Subscribe bodies while somebody watches: the node works for subscribers only."""
        topic = f'{self._watched}/bodies'
        if not self._publisher.get_subscription_count():
            if self._bodies is not None:
                self.destroy_subscription(self._bodies)
                self._bodies = None
            return
        offers = [offer.qos_profile for offer in self.get_publishers_info_by_topic(topic)]
        if self._bodies is None and offers:
            self._bodies = self.create_subscription(
                pop_msgs.BodyArray, topic, self._on_bodies, matched_qos(offers))

    def _on_bodies(self, message: Any) -> None:
        meshes = self._meshes(message)
        gone, self._shown = self._shown - set(meshes), set(meshes)
        for marker in self._markers.build(
                meshes, gone, stamp_ns(message.header), message.header.frame_id):
            self._publisher.publish(marker)

    def _meshes(self, message: Any) -> dict[int, Any]:
        if not self._fits:
            self._drop(NO_MODEL if self._fits is None else OTHER_MODEL)
            return {}
        meshes = {}
        for body in message.bodies:
            try:
                meshes[int(body.id)] = self._rebuilder.vertices(body)
            except BadMessageError as error:
                self._drop(str(error))
        return meshes

    def _drop(self, reason: str) -> None:
        self._drops[reason] += 1

    def _report(self) -> None:
        """Say what was dropped since the last report, and once that nobody publishes."""
        for reason, count in self._drops.items():
            self.log.warning(f'{count} dropped in {REPORT_S:g} s: {reason}')
        self._drops.clear()
        waits = self._publisher.get_subscription_count() and self._bodies is None
        if waits and not self._said_waiting:
            self._said_waiting = True
            self.log.warning(
                f'expected bodies on {self._watched}/bodies, found no publisher: is the node '
                'running, under that name (--node), where pop_msgs is installed?')
