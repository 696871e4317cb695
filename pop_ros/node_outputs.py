"""The node's outputs: which are wanted, and how they are published."""

from __future__ import annotations

from collections.abc import Iterable

from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from pop_core.body.model import BodyModel
from pop_ros.body_messages import OUTPUT_TYPES, TF, Output
from pop_ros.humans import HUMANS, HumansTopics
from pop_ros.interop import MISFITS
from pop_ros.node_config import NodeConfig
from pop_ros.pop_messages import model_message, pop_msgs
from pop_ros.qos import output_qos
from pop_ros.to_messages import make_header


class NodeOutputs:
    """Publishers of everything that is computed of a frame."""

    def __init__(self, node: Node) -> None:
        """Advertise the topics."""
        self._node = node
        self._humans = HumansTopics(node)
        self._publishers = {
            name: node.create_publisher(
                kind, '/tf' if name == TF else f'~/{name}', output_qos(),
                qos_overriding_options=QoSOverridingOptions.with_default_policies())
            for name, kind in OUTPUT_TYPES.items()
        }
        self._model = None if pop_msgs is None else node.create_publisher(
            pop_msgs.BodyModel, '~/body_model', output_qos(latched=True))

    def wanted(self, config: NodeConfig) -> list[str]:
        """Return the outputs that somebody subscribes, or all of them if not lazy."""
        tf_off = {TF} if config.tf.frames == 'off' else set()
        wanted = [
            name for name, publisher in self._publishers.items() if name not in tf_off
            and (not config.lazy or publisher.get_subscription_count())]
        self._humans.switch(config.rep155)
        if config.rep155 and (not config.lazy or self._humans.is_heard()):
            wanted.append(HUMANS)
        return wanted

    def publish(self, outputs: Iterable[Output]) -> None:
        """Publish messages; may be called from any thread."""
        for name, message in outputs:
            if name == HUMANS:
                self._humans.publish(message)
            else:
                self._publishers[name].publish(message)

    def publish_model(self, model: BodyModel) -> None:
        """Latch what a receiver of ~/bodies needs to know, where pop_msgs is installed."""
        if self._model is not None:
            now_ns = self._node.get_clock().now().nanoseconds
            self._model.publish(model_message(model, make_header(now_ns, '')))

    @property
    def missing(self) -> tuple[str, ...]:
        """Return in words which outputs are not there, and why."""
        texts = []
        if self._model is None:
            texts.append('pop_msgs is not installed: no ~/bodies and no ~/body_model')
        if TF not in self._publishers:
            texts.append('tf2_msgs is not installed: nothing goes to /tf')
        texts += [f'{reason}: no ~/{name}' for name, reason in MISFITS.items()
                  if 'version' in reason]
        return tuple(texts)
