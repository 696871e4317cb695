"""Prints, as JSON, what a REP-155 listener finds: ids, messages of a body, frames, topics."""

import json
import time

import rclpy
from hri_msgs.msg import IdsList, NormalizedRegionOfInterest2D, Skeleton2D
from sensor_msgs.msg import Image, JointState
from support.plain_messages import plain
from tf2_msgs.msg import TFMessage

KINDS = {'roi': NormalizedRegionOfInterest2D, 'cropped': Image, 'skeleton2d': Skeleton2D,
         'joint_states': JointState}
TIMEOUT_S = 50.0


def main() -> None:
    rclpy.init()
    node = rclpy.create_node('listener')
    lists, found, frames = [], {}, []
    node.create_subscription(IdsList, '/humans/bodies/tracked', lists.append, 10)
    node.create_subscription(TFMessage, '/tf', frames.append, 10)
    end_s = time.monotonic() + TIMEOUT_S

    def spin(done) -> None:
        while not done() and time.monotonic() < end_s:
            rclpy.spin_once(node, timeout_sec=0.1)

    spin(lambda: lists and lists[-1].ids and frames)
    first = list(lists[-1].ids)
    for name, kind in KINDS.items():
        node.create_subscription(
            kind, f'/humans/bodies/{first[0]}/{name}',
            lambda message, name=name: found.setdefault(name, message), 10)
    spin(lambda: len(found) == len(KINDS))
    before = topics(node)
    spin(lambda: len(lists[-1].ids) < len(first) and not has_topics(
        node, set(first) - set(lists[-1].ids)))
    after = topics(node)
    spin(lambda: not topics(node))
    print(json.dumps({  # noqa: T201 - what the test reads
        'first': first, 'last': list(lists[-1].ids), 'header': plain(lists[0].header),
        'found': {name: plain(message) for name, message in found.items()},
        'frames': plain(frames[0].transforms), 'before': before, 'after': after,
        'off': topics(node)}))


def topics(node) -> list[str]:
    """Return the topics of bodies that somebody publishes."""
    return sorted(name for name, _ in node.get_topic_names_and_types()
                  if name.startswith('/humans/bodies/') and node.count_publishers(name))


def has_topics(node, ids: set[str]) -> bool:
    """Return whether a topic of one of some bodies is still published; they go one by one."""
    return any(name.split('/')[3] in ids for name in topics(node))


if __name__ == '__main__':
    main()
