"""Best-effort VGA images from one process to another; prints how many arrived."""

import array
import sys
import time

import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image

COUNT, RATE_HZ = 60, 30.0
PROFILE = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def send() -> None:
    node = rclpy.create_node('sender')
    publisher = node.create_publisher(Image, '/vga', PROFILE)
    while not publisher.get_subscription_count():
        time.sleep(0.02)
    time.sleep(0.5)  # both sides must have matched
    data = array.array('B', bytes(640 * 480 * 3))
    image = Image(height=480, width=640, step=1920, encoding='rgb8', data=data)
    for _ in range(COUNT):
        publisher.publish(image)
        time.sleep(1 / RATE_HZ)
    time.sleep(0.5)


def receive() -> None:
    node = rclpy.create_node('receiver')
    arrived = 0

    def count(_: Image) -> None:
        nonlocal arrived
        arrived += 1

    node.create_subscription(Image, '/vga', count, PROFILE)
    started = quiet_since = time.monotonic()
    seen = 0
    while time.monotonic() - started < 20 and not (seen and time.monotonic() - quiet_since > 1.0):
        rclpy.spin_once(node, timeout_sec=0.05)
        if arrived != seen:
            seen, quiet_since = arrived, time.monotonic()
    sys.stdout.write(f'{arrived}\n')


if __name__ == '__main__':
    rclpy.init()
    send() if sys.argv[1] == 'send' else receive()
    rclpy.shutdown()
