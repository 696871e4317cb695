"""Publishes people as REP-155 asks, like the node, until ended.

There are two bodies; then one has left; at last the node is told to say nothing below /humans.
"""

import time

import numpy as np
import rclpy
from support.estimates import CAMERA, estimate

from pop_core.body.default_body import default_body
from pop_core.rgbd import RgbdFrame
from pop_ros.humans import HumansFrame, HumansTopics
from pop_ros.interop_person import PersonReader
from pop_ros.to_messages import make_header

STAMP_NS = 1_700_000_000_987_654_321
FRAME_ID = 'optical'
STAYS, LEAVES = 3, 4
FRAMES_WITH_BOTH, FRAMES_WITH_ONE = 40, 40


def main() -> None:
    model, header = default_body(), make_header(STAMP_NS, FRAME_ID)
    people = [PersonReader(model).read(seed, estimate(model, seed), CAMERA)
              for seed in (STAYS, LEAVES)]
    rgb = np.zeros((CAMERA.height, CAMERA.width, 3), np.uint8)
    frame = RgbdFrame(rgb, np.ones(rgb.shape[:2], np.float32), CAMERA, STAMP_NS)
    rclpy.init()
    node = rclpy.create_node('pop', namespace='front')
    topics = HumansTopics(node)
    topics.switch(True)
    while not topics.is_heard():
        time.sleep(0.05)
    for seen in [people] * FRAMES_WITH_BOTH + [people[:1]] * FRAMES_WITH_ONE:
        topics.publish(HumansFrame(seen, frame, header))
        time.sleep(0.1)
    topics.switch(False)
    topics.publish(HumansFrame(people, frame, header))
    time.sleep(60)


if __name__ == '__main__':
    main()
