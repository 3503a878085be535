# SPDX-License-Identifier: Apache-2.0
"""The node's answers to a scene that is being published, for a publisher that waits for them."""

from __future__ import annotations

import time
from collections.abc import Sequence

from hpccd.msg import ContactArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile

from hpccd_ros.middleware import topic_names
from hpccd_ros.middleware.fields import stamp_to_ns


class Answers:
    """Listens to `contacts` through `node`. Make it before the publishers: the node then knows this listener before
    it has the first frame."""

    def __init__(self, node: Node):
        # Late ones of other frames may lie before the one that is waited for.
        self._subscription = node.create_subscription(
            ContactArray, topic_names.CONTACTS, self._take, QoSProfile(depth=100)
        )
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._stamp = -1

    def close(self) -> None:
        self._executor.shutdown()

    def await_node(self, wait: float, stop: Sequence = ()) -> bool:
        """Wait until something publishes contacts, `wait` s at most or until `stop` is filled."""
        return self._spin_until(lambda: self._subscription.get_publisher_count() > 0, wait, stop)

    def await_step(self, stamp: int, wait: float, stop: Sequence = ()) -> bool:
        """Wait until the step that ends at `stamp` (ns), or a later one, is answered; like `await_node`."""
        return self._spin_until(lambda: self._stamp >= stamp, wait, stop)

    def _spin_until(self, ready, wait, stop) -> bool:
        deadline = time.monotonic() + wait
        while not ready():
            if stop or time.monotonic() >= deadline:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True

    def _take(self, message: ContactArray) -> None:
        self._stamp = max(self._stamp, stamp_to_ns(message.header.stamp))
