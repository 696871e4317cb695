"""A camera and a listener in the test's own process, for a node that runs in another."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, TypeVar

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image

from pop_core.rgbd import RgbdFrame
from pop_ros.image_messages import color_message, depth_message, info_message
from pop_ros.qos import output_qos
from pop_ros.to_messages import make_header

ListenerT = TypeVar('ListenerT', bound='Listener')
FRAME_ID = 'camera_color_optical_frame'


class Listener:
    """Keeps what the node publishes."""

    def __init__(self, **listens: type) -> None:
        """Subscribe outputs of /pop by name and type."""
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.node = Node('player', context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.received: dict[str, list[Any]] = {name: [] for name in listens}
        for name, kind in listens.items():
            self.node.create_subscription(
                kind, f'/pop/{name}', self.received[name].append, output_qos())

    def __enter__(self: ListenerT) -> ListenerT:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def spin_until(self, done: Callable[[], object], timeout_s: float = 60.0) -> bool:
        end_s = time.monotonic() + timeout_s
        while not done() and time.monotonic() < end_s:
            self._executor.spin_once(timeout_sec=0.05)
        return bool(done())

    def call(self, kind: type, service: str, request: object, timeout_s: float = 60.0) -> Any:
        """Return the answer of a service of /pop."""
        client = self.node.create_client(kind, f'/pop/{service}')
        assert client.wait_for_service(10)
        future = client.call_async(request)
        assert self.spin_until(future.done, timeout_s)
        self.node.destroy_client(client)
        return future.result()


class Player(Listener):
    """Publishes frames too, as a driver does."""

    def __init__(self, **listens: type) -> None:
        """Subscribe outputs and advertise a camera."""
        super().__init__(**listens)
        self._color = self.node.create_publisher(Image, 'color/image', 5)
        self._depth = self.node.create_publisher(Image, 'depth/image', 5)
        self._info = self.node.create_publisher(CameraInfo, 'color/camera_info', 5)

    def is_heard(self) -> bool:
        """Return whether the node subscribes colour, depth and camera info."""
        publishers = (self._color, self._depth, self._info)
        return all(p.get_subscription_count() for p in publishers)

    def announce(self, frame: RgbdFrame) -> None:
        """Publish the camera of a frame, well before its images: topics overtake each other."""
        self._info.publish(info_message(frame.camera, make_header(frame.stamp_ns, FRAME_ID)))
        self.spin_until(lambda: False, timeout_s=0.5)

    def play(self, frame: RgbdFrame) -> None:
        header = make_header(frame.stamp_ns, FRAME_ID)
        self._info.publish(info_message(frame.camera, header))
        self._color.publish(color_message(frame.rgb, header))
        self._depth.publish(depth_message(frame.depth_m, header))
