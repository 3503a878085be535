# SPDX-License-Identifier: Apache-2.0
"""Notice frames of meshes that the node does not have: usually a misspelt name, which nothing else would report."""

from collections.abc import Mapping
from typing import Any

from geometry_msgs.msg import PoseStamped
from hpccd.msg import MeshVertices
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.validate_full_topic_name import validate_full_topic_name
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh
from visualization_msgs.msg import Marker

from hpccd_ros.base.quoting import counted, listed, nearest
from hpccd_ros.frames.drops import Reason, Rejection
from hpccd_ros.middleware import graph, message_types, qos, topic_names
from hpccd_ros.node.accounts import Accounts
from hpccd_ros.node.unheard_topics import UnheardTopics

# Bounds the subscriptions that untrusted publishers can cause at a time.
_MOST_TOPICS = 16
# Bounds the names that untrusted publishers can add to its counters.
_MOST_NAMES = 64
_OTHERS = "(others)"
_TYPES = {
    topic_names.VERTICES: (message_types.VERTICES, MeshVertices),
    topic_names.POINTS: (message_types.POINTS, PointCloud2),
    topic_names.SHAPE: (message_types.SHAPE, Mesh),
    topic_names.MARKER: (message_types.MARKER, Marker),
    topic_names.POSE: (message_types.POSE, PoseStamped),
}


class UnknownMeshWatch:
    """Looks at the graph once a second for vertex topics that have publishers and belong to no mesh of any node.

    A mesh is another node's where one with a service of type hpccd/srv/Detect subscribes to its topology: so do
    detectors to their meshes. Recorders, which subscribe to anything, have no such service; nodes like this one, which
    subscribe to the vertices only to count them, leave the topology alone.
    A topic is taken up when it is found a second time, since a node that starts is discovered piece by piece, and let
    go when its publishers have left or another node has taken it over.
    Where parameter count_unknown_meshes is set, they are subscribed to raw (without deserialising) and each frame is
    counted as dropped; else they are only named.
    """

    def __init__(
        self, node: Node, settings: dict[str, Any], meshes: Mapping[str, Mapping[str, Any]], accounts: Accounts
    ) -> None:
        self._node = node
        self._unheard = UnheardTopics(node, meshes, settings["points"])
        self._known = list(settings["meshes"])
        self._accounts = accounts
        self._count = settings["count_unknown_meshes"]
        self._topics: dict[str, Subscription | None] = {}
        self._found: set[str] = set()
        self._beyond: list[str] = []
        self._names: set[str] = set()
        self._prefix = node.resolve_topic_name(f"{topic_names.MESHES}x").removesuffix("x")
        # Steady time: simulated time may stand still.
        self._timer = node.create_timer(1.0, self._check, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        self._node.destroy_timer(self._timer)
        for topic in list(self._topics):
            self._release(topic)

    def warnings(self) -> list[str]:
        """One line for each vertex topic that belongs to no mesh, and one for those beyond the bound."""
        known = listed(self._known) or "empty"
        lines = [
            f"{topic} belongs to no mesh in the parameter meshes ({known}){self._meant(topic)}"
            for topic in self._topics
        ]
        if self._beyond:
            what = "counted" if self._count else "named"
            first, more = self._beyond[0], len(self._beyond)
            lines.append(
                f"{counted(more, 'more topic')} without a mesh, not {what} ({_MOST_TOPICS} are), such as {first}; add "
                "their meshes to the parameter meshes, or end their publishers"
            )
        return lines + self._unheard.warnings

    def _meant(self, topic: str) -> str:
        mesh, _, kind = topic.removeprefix(self._prefix).rpartition("/")
        near = nearest(mesh, self._known)
        meant = f"did you mean {self._prefix}{near}/{kind}?" if near else "add its mesh there, or correct the name"
        return f"; {meant}"

    def _check(self) -> None:
        unknown = self._unknown()
        for topic in [topic for topic in self._topics if topic not in unknown]:
            self._release(topic)
        wanted = [topic for topic in unknown if topic in self._found and topic not in self._topics]
        free = _MOST_TOPICS - len(self._topics)
        self._found, self._beyond = set(unknown), wanted[free:]
        for topic in wanted[:free]:
            self._topics[topic] = self._listen(topic, *unknown[topic]) if self._count else None
        self._unheard.look(unknown)

    def _unknown(self) -> dict[str, tuple[str, type]]:
        """Topic -> (mesh, message type)."""
        found = {}
        for topic, types in self._node.get_topic_names_and_types():
            mesh, _, kind = topic.removeprefix(self._prefix).rpartition("/")
            if not topic.startswith(self._prefix) or kind not in _TYPES or mesh in self._known:
                continue
            type_name, message = _TYPES[kind]
            if type_name not in types or not _is_valid(topic) or not self._node.count_publishers(topic):
                continue
            if not self._belongs_to_another(mesh):
                found[topic] = mesh, message
        return found

    def _belongs_to_another(self, mesh: str) -> bool:
        listeners = self._node.get_subscriptions_info_by_topic(f"{self._prefix}{mesh}/{topic_names.TOPOLOGY}")
        return any(graph.detects(self._node, listener.node_name, listener.node_namespace) for listener in listeners)

    def _listen(self, topic: str, mesh: str, message: type) -> Subscription:
        name = mesh if mesh in self._names or len(self._names) < _MOST_NAMES else _OTHERS
        self._names.add(name)

        def count(data: bytes) -> None:
            self._accounts.metrics.frame_received(name, None)
            self._accounts.rejected(Rejection(name, Reason.UNKNOWN_MESH))

        # Best effort is compatible with every publisher.
        return self._node.create_subscription(message, topic, count, qos.vertices("best_effort", 10), raw=True)

    def _release(self, topic: str) -> None:
        subscription = self._topics.pop(topic)
        if subscription is not None:
            self._node.destroy_subscription(subscription)


def _is_valid(topic: str) -> bool:
    """Participants that are not of ROS may have names in which it finds an error, such as a digit after a slash."""
    try:
        validate_full_topic_name(topic)
    except InvalidTopicNameException:
        return False
    return True
