"""Prints, as JSON, the first message of every output of /pop for other packages."""

import json

import rclpy
from hri_msgs.msg import IdsList
from pop_msgs.msg import BodyArray
from support.plain_messages import plain
from vision_msgs.msg import Detection3DArray
from yolo_msgs.msg import DetectionArray
from zed_msgs.msg import ObjectsStamped

KINDS = {
    '/pop/bodies': BodyArray, '/pop/vision_detections': Detection3DArray,
    '/pop/yolo_detections': DetectionArray, '/pop/zed_objects': ObjectsStamped,
    '/humans/bodies/tracked': IdsList}


def main() -> None:
    rclpy.init()
    node = rclpy.create_node('listener')
    found = {}
    for topic, kind in KINDS.items():
        node.create_subscription(
            kind, topic, lambda message, topic=topic: found.setdefault(topic, message), 10)
    while len(found) < len(KINDS):
        rclpy.spin_once(node)
    print(json.dumps({t: plain(m) for t, m in found.items()}))  # noqa: T201 - the test reads it


if __name__ == '__main__':
    main()
