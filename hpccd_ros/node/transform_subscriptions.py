# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that fill a TransformBuffer."""

from collections.abc import Callable

from rclpy.node import Node

from hpccd_ros.frames.rate_limit import RateLimit
from hpccd_ros.frames.transform_buffer import TransformBuffer
from hpccd_ros.middleware import qos, qos_overrides, transform_topics
from hpccd_ros.middleware.message_types import message_class
from hpccd_ros.middleware.transform_topics import TransformTopic


class TransformInput:
    """Subscribed from construction until ``close``.

    on_change: called after each message that brought a transform. warn: takes texts about those that are refused.
    max_rate: most messages a second that are looked at of each topic.
    """

    def __init__(
        self,
        node: Node,
        buffer: TransformBuffer,
        max_rate: float,
        on_change: Callable[[], None],
        warn: Callable[[str], None],
    ) -> None:
        self._node = node
        self._buffer = buffer
        self._on_change = on_change
        self._warn = warn
        self._max_rate = max_rate
        self._subscriptions = [self._subscribe(topic) for topic in transform_topics.understood()]

    def close(self) -> None:
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()

    def _subscribe(self, topic: TransformTopic):
        limit = RateLimit(self._max_rate)

        def take(message) -> None:
            if not limit.allows():
                text = f"more than max_rate = {self._max_rate:g} messages a second; some are dropped"
                self._warn(f"{topic.name}: {text}")
                return
            for transform in transform_topics.in_message(message):
                try:
                    transform_topics.keep(self._buffer, transform, topic.static)
                except ValueError as error:
                    self._warn(f"{topic.name}: {error}")
            self._on_change()

        profile = qos.TRANSFORMS_STATIC if topic.static else qos.TRANSFORMS
        message = message_class(topic.type_name)
        return qos_overrides.create_subscription(self._node, message, topic.name, take, profile)
