# SPDX-License-Identifier: Apache-2.0
"""Check that each topic has one type: parameters and remappings may give one topic several uses."""

from collections.abc import Iterator
from typing import Any

from rclpy.node import Node

from hpccd_ros.base.quoting import shortened
from hpccd_ros.middleware import message_types, topic_names, transform_topics
from hpccd_ros.params import robot_parameters
from hpccd_ros.params.table import ROBOT
from hpccd_ros.record.recorded_topics import ANSWERS, POSITIONS

# Types of the node's own topics, and of those that every ROS node has.
_PUBLISHED = {
    **ANSWERS,
    topic_names.STOP: "std_msgs/msg/Bool",
    topic_names.MARKERS: "visualization_msgs/msg/MarkerArray",
    topic_names.SURFACE: message_types.POINTS,
    topic_names.DIAGNOSTICS: "diagnostic_msgs/msg/DiagnosticArray",
    "~/transition_event": "lifecycle_msgs/msg/TransitionEvent",
    "/rosout": "rcl_interfaces/msg/Log",
    "/parameter_events": "rcl_interfaces/msg/ParameterEvent",
    "/clock": "rosgraph_msgs/msg/Clock",
}


def contradiction(node: Node, settings: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> str | None:
    """An error about two uses of one topic with different types, or None. All names must be resolvable."""
    first: dict[str, tuple[str, str]] = {}
    for use, topic, type_name in _uses(settings, meshes):
        resolved = node.resolve_topic_name(topic)
        other, of_other = first.setdefault(resolved, (use, type_name))
        if of_other != type_name:
            return (
                f"{other} and {use}: both use the topic {shortened(resolved)}, the first as {of_other}, the second as "
                f"{type_name}; give each a topic of its own"
            )
    return None


def uses_transforms(settings: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> bool:
    """Whether transforms move a robot or a mesh."""
    of_meshes = any("tf" in (mesh["transform"], mesh["input"]) for mesh in meshes.values())
    return of_meshes or robot_parameters.need_transforms(settings[ROBOT])


def _uses(settings: dict[str, Any], meshes: dict[str, dict[str, Any]]) -> Iterator[tuple[str, str, str]]:
    """(the use in words, name of the topic, its type) for each use."""
    for topic, type_name in _PUBLISHED.items():
        yield topic, topic, type_name
    for mesh, values in meshes.items():
        yield topic_names.topology(mesh), topic_names.topology(mesh), message_types.TOPOLOGY
        for kind in topic_names.positions(values["input"]):
            topic = topic_names.of_mesh(mesh, kind)
            yield topic, topic, POSITIONS[kind]
    if uses_transforms(settings, meshes):
        for transforms in transform_topics.understood():
            yield transforms.name, transforms.name, transforms.type_name
    for robot, topic in robot_parameters.topics(settings[ROBOT]).items():
        yield f"{ROBOT}.{robot}.description", topic, message_types.DESCRIPTION
    for topic, robots in robot_parameters.joint_topics(settings[ROBOT]).items():
        yield f"{ROBOT}.{robots[0]}.joint_states", topic, message_types.JOINT_STATES
