# SPDX-License-Identifier: Apache-2.0
"""Notice frames of meshes that the node was not told of: usually a misspelt name, else silently unheard."""

from collections.abc import Callable

from hpccd.msg import MeshVertices
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2

from hpccd_ros import qos
from hpccd_ros.drops import DropCounter, Reason

# Bounds what strangers can make the node subscribe to.
_MOST_TOPICS = 16
_TYPES = {
    "vertices": ("hpccd/msg/MeshVertices", MeshVertices),
    "points": ("sensor_msgs/msg/PointCloud2", PointCloud2),
}


class UnknownMeshWatch:
    """Looks at the graph once a second for vertex topics beside those of the known meshes.

    count: subscribe to them raw (without deserialising) and count each frame as dropped; else only name them.
    """

    def __init__(
        self,
        node: Node,
        known: list[str],
        drops: DropCounter,
        received: Callable[[str, None], None],
        count: bool,
    ) -> None:
        self._node = node
        self._known = known
        self._drops = drops
        self._received = received
        self._count = count
        self._topics: dict[str, Subscription | None] = {}
        self._prefix = node.resolve_topic_name("meshes/x").removesuffix("x")
        # Steady time: simulated time may stand still.
        self._timer = node.create_timer(1.0, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        self._node.destroy_timer(self._timer)
        for subscription in self._topics.values():
            if subscription is not None:
                self._node.destroy_subscription(subscription)
        self._topics.clear()

    def warnings(self) -> list[str]:
        """One line for each vertex topic that belongs to no mesh of the node and still has publishers."""
        return [
            f"{topic} belongs to no mesh in parameter meshes"
            for topic in self._topics
            if self._node.count_publishers(topic)
        ]

    def _look(self) -> None:
        for topic, types in self._node.get_topic_names_and_types():
            if topic in self._topics or not topic.startswith(self._prefix) or len(self._topics) >= _MOST_TOPICS:
                continue
            mesh, _, kind = topic.removeprefix(self._prefix).rpartition("/")
            if kind not in _TYPES or mesh in self._known or not self._node.count_publishers(topic):
                continue
            type_name, message = _TYPES[kind]
            if type_name in types:
                self._topics[topic] = self._listen(topic, mesh, message) if self._count else None
                self._node.get_logger().warning(
                    f"{topic} belongs to no mesh: parameter meshes has {', '.join(self._known) or 'none'}"
                )

    def _listen(self, topic: str, mesh: str, message: type) -> Subscription:
        def count(data: bytes) -> None:
            self._received(mesh, None)
            self._drops.count(mesh, Reason.UNKNOWN_MESH)

        # Best effort is compatible with every publisher.
        return self._node.create_subscription(message, topic, count, qos.vertices("best_effort", 10), raw=True)
