# SPDX-License-Identifier: Apache-2.0
"""Topics of meshes that no node subscribes to because of their name, such as mesh/cloth/vertices in place of
meshes/cloth/vertices."""

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from rclpy.node import Node

from hpccd_ros.base.quoting import nearest
from hpccd_ros.middleware import graph, mesh_inputs, message_types, topic_names

# Nothing but meshes has these types. Those of other inputs are of interest only if the name is near.
_OURS = (message_types.TOPOLOGY, message_types.VERTICES)
# Bounds what other participants can make the node report.
_MOST = 16
# difflib, 0 .. 1: 0.95 for /mesh/cloth/vertices and /meshes/cloth/vertices, 0.81 for /cloth/vertices and the same, 0.53
# for /camera/points and /meshes/cloth/points.
_NEAR = 0.7


class UnheardTopics:
    """meshes: name -> parameters mesh.NAME.*. `look` about once a second; ``warnings``: one line a topic."""

    def __init__(self, node: Node, meshes: Mapping[str, Mapping[str, Any]], points: Collection[str]) -> None:
        self._node = node
        self._namespace = f"{node.get_namespace().rstrip('/')}/"
        # Full name -> type, of the topics on which messages must come.
        self._expected: dict[str, str] = {}
        # Full name -> (mesh, its kind, topic in use), of the positions of meshes that come in another form.
        self._other_inputs: dict[str, tuple[str, str, str]] = {}
        for mesh, values in meshes.items():
            topics = {
                kind: node.resolve_topic_name(topic_names.of_mesh(mesh, kind))
                for kind in (topic_names.TOPOLOGY, *topic_names.POSITIONS)
            }
            used = topic_names.positions(values["input"])
            for kind in _needed(values, mesh in points):
                self._expected[topics[kind]] = mesh_inputs.TYPE_NAMES[kind]
            for kind in set(topic_names.POSITIONS) - set(used):
                self._other_inputs[topics[kind]] = mesh, kind, topics[used[0]]
        self._found: set[str] = set()
        self.warnings: list[str] = []

    def look(self, others: Iterable[str]) -> None:
        """others: topics that are reported elsewhere. A topic counts when it is found a second time: nodes that start
        are discovered piece by piece."""
        lacking = [topic for topic in self._expected if not self._node.count_publishers(topic)]
        known = {*self._expected, *others}
        candidates = (
            {}
            if not lacking
            else {
                topic: line
                for topic, types in self._node.get_topic_names_and_types()
                if topic not in known and (line := self._line(topic, types, lacking))
            }
        )
        self.warnings = [line for topic, line in candidates.items() if topic in self._found][:_MOST]
        self._found = set(candidates)

    def _line(self, topic: str, types: list[str], lacking: list[str]) -> str:
        """About a topic that only a wrong name keeps from this node; "": it is none."""
        if topic in self._other_inputs:
            mesh, kind, in_use = self._other_inputs[topic]
            unused = in_use in lacking and self._node.count_publishers(topic)
            remedy = f"set mesh.{mesh}.input: {kind}, or publish on {in_use}"
            return f"{topic}: the node does not subscribe to this topic; {remedy}" if unused else ""
        same_type = [name for name in lacking if self._expected[name] in types]
        ours = next((name for name in _OURS if name in types), "")
        if not (same_type or ours) or not self._node.count_publishers(topic):
            return ""
        near = nearest(topic, same_type, _NEAR)
        if not near and not (ours and topic.startswith(self._namespace)):
            return ""
        if self._is_heard(topic):
            return ""
        if near:
            return f"{topic}: the node does not subscribe to this topic; did you mean {near}?"
        kind = topic_names.TOPOLOGY if ours == message_types.TOPOLOGY else topic_names.VERTICES
        return (
            f"{topic} ({ours}): the node does not subscribe to this topic; publish on meshes/NAME/{kind}, with a NAME "
            "out of the parameter meshes"
        )

    def _is_heard(self, topic: str) -> bool:
        """By an hpccd node; recorders subscribe to anything."""
        found = self._node.get_subscriptions_info_by_topic(topic)
        return any(graph.detects(self._node, endpoint.node_name, endpoint.node_namespace) for endpoint in found)


def _needed(values: Mapping[str, Any], points: bool) -> list[str]:
    """Kinds of topics on which a mesh with these parameters needs a message. points: it is in that parameter."""
    given_as, by_file = values["input"], bool(values["file"])
    shape_alone = given_as in (topic_names.POSE, topic_names.BY_TRANSFORMS)
    positions = [
        kind
        for kind in topic_names.positions(given_as)
        if not (by_file and (values["static"] or (shape_alone and kind == topic_names.VERTICES)))
    ]
    return positions if by_file or topic_names.is_whole(given_as, points) else [topic_names.TOPOLOGY, *positions]
