"""Publishes the bodies of estimate(seed) for seeds given, as the node does, until it is ended.

python bodies_sender.py DIGEST|same SEED...
"""

import sys
import time

import rclpy
from support.estimates import estimate

from pop_core.body.default_body import default_body
from pop_ros.pop_messages import bodies_message, model_message, pop_msgs
from pop_ros.qos import output_qos
from pop_ros.to_messages import make_header

STAMP_NS = 1_700_000_000_987_654_321
FRAME_ID = 'optical'


def main() -> None:
    digest, *seeds = sys.argv[1:]
    model = default_body()
    rclpy.init()
    node = rclpy.create_node('pop')
    latched = node.create_publisher(
        pop_msgs.BodyModel, '~/body_model', output_qos(latched=True))
    message = model_message(model, make_header(STAMP_NS, ''))
    message.digest = message.digest if digest == 'same' else digest
    latched.publish(message)
    publisher = node.create_publisher(pop_msgs.BodyArray, '~/bodies', output_qos())
    header = make_header(STAMP_NS, FRAME_ID)
    people = [estimate(model, int(seed)) for seed in seeds]
    array = bodies_message(people, [int(seed) for seed in seeds], header)
    spoilt = bodies_message([estimate(model, 0)], [77], header).bodies[0]
    spoilt.parameters.betas = [float('nan')] * model.n_betas
    array.bodies.append(spoilt)
    while True:
        publisher.publish(array)
        time.sleep(1.0)  # a Python receiver needs 0.2 s for each of two meshes


if __name__ == '__main__':
    main()
