# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that fill a TransformBuffer: tf2's topics where its messages are installed, and topics of our own.

There is no wheel of tf2_msgs, so geometry_msgs/TransformStamped on ``transforms`` and ``transforms_static`` is always
understood as well.
"""

from collections.abc import Callable

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node

from hpccd_ros import convert, qos
from hpccd_ros.rate_limit import RateLimit
from hpccd_ros.rigid import Rigid
from hpccd_ros.transforms import TransformBuffer

try:
    from tf2_msgs.msg import TFMessage
except ImportError:
    TFMessage = None


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
        topics = [("transforms", TransformStamped, False), ("transforms_static", TransformStamped, True)]
        if TFMessage is not None:
            topics += [("/tf", TFMessage, False), ("/tf_static", TFMessage, True)]
        self._subscriptions = [self._subscribe(*topic) for topic in topics]

    def close(self) -> None:
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()

    def _subscribe(self, topic: str, kind: type, static: bool):
        limit = RateLimit(self._max_rate)

        def take(message) -> None:
            if not limit.allows():
                self._warn(f"{topic}: more than max_rate = {self._max_rate:g} messages a second; some are dropped")
                return
            for transform in [message] if kind is TransformStamped else message.transforms:
                self._add(topic, transform, static)
            self._on_change()

        return self._node.create_subscription(kind, topic, take, qos.TRANSFORMS_STATIC if static else qos.TRANSFORMS)

    def _add(self, topic: str, message: TransformStamped, static: bool) -> None:
        shift, turn = message.transform.translation, message.transform.rotation
        try:
            self._buffer.add(
                message.header.frame_id,
                message.child_frame_id,
                Rigid.of((shift.x, shift.y, shift.z), (turn.x, turn.y, turn.z, turn.w)),
                None if static else convert.stamp_to_ns(message.header.stamp),
            )
        except ValueError as error:
            names = f"{message.child_frame_id[:80]!r} to {message.header.frame_id[:80]!r}"
            self._warn(f"{topic}: transform from {names}: {error}")
