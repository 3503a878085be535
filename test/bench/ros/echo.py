# SPDX-License-Identifier: Apache-2.0
"""The bare cost of ROS: answers each vertex message at once with contacts that it was given before.

`python -m bench.ros.echo NAMESPACE`. Same message types, sizes and QoS as the node's; no work in between.
"""

from __future__ import annotations

import sys

import rclpy
from hpccd.msg import ContactArray, MeshVertices
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from hpccd_ros.middleware import environment, qos, stop_signals

# The last two are kept for a late joiner: those of even and of odd steps.
ANSWERS = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def main(namespace: str) -> int:
    stop = Future()
    stop_signals.watch(lambda: stop.set_result(None))
    environment.prepare()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("echo", namespace=namespace, start_parameter_services=False)
    answers: dict[int, ContactArray] = {}
    contacts = node.create_publisher(ContactArray, "echo/contacts", qos.CONTACTS)

    def take(message: MeshVertices) -> None:
        answer = answers.get(message.step % 2)
        if answer is not None:
            answer.header.stamp, answer.step = message.header.stamp, message.step
            contacts.publish(answer)

    node.create_subscription(ContactArray, "echo/answers", lambda m: answers.update({m.step % 2: m}), ANSWERS)
    node.create_subscription(MeshVertices, "echo/vertices", take, qos.vertices("reliable", 10))
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    stop_signals.spin(executor, stop)
    executor.shutdown(timeout_sec=1.0)
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
