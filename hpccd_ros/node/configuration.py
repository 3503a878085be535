# SPDX-License-Identifier: Apache-2.0
"""The parameters of a node: declared and checked when it starts, followed as they change. Parameters and remappings may
give one topic several uses, which must agree in its type."""

import sys
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.node import Node

from hpccd_ros.base.quoting import listed, shortened
from hpccd_ros.detect.core import unusable_options
from hpccd_ros.detect.scene import SceneBuilder
from hpccd_ros.middleware import environment, message_types, qos_overrides, topic_names, transform_topics
from hpccd_ros.node.node_recording import unrecordable
from hpccd_ros.params import parameters, robot_parameters, scene_parameters, unknown
from hpccd_ros.params.robot_parameters import NO_ROBOTS, Robots
from hpccd_ros.params.table import ROBOT
from hpccd_ros.params.values import ParameterError
from hpccd_ros.record.recorded_topics import POSITIONS, RESULTS

Meshes = dict[str, dict[str, Any]]


class Configuration:
    """``settings``, ``meshes`` (name -> parameters mesh.NAME.*) and the detector's ``options`` as they are now;
    ``robots``: those whose description is known; ``warnings``: about parameter files without effect.

    Raises ParameterError for parameters that the node cannot start with.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        parameters.check_command_line(node, sys.argv)
        self.settings, self.meshes = parameters.declare(node)
        # Before the values: a misspelt name often leaves another parameter without its value.
        foreign = unknown.check(parameters.unknown_overrides(node), self.settings)
        scene_parameters.check(self.settings, self.meshes)
        topics = topic_names.subscribed(self.meshes, robot_parameters.subscribed(self.settings[ROBOT]))
        if why := self._unusable_topics(self.settings, self.meshes) or qos_overrides.unusable_override(node):
            raise ParameterError(why)
        of_topics = qos_overrides.known(node, topics)  # declared only when their topics are there
        for name in foreign:
            if name not in of_topics:
                node.get_logger().warning(unknown.warning(name))
        self.warnings = parameters.files_without_section(node, sys.argv)
        for warning in self.warnings:
            node.get_logger().warning(warning)
        self.robots: Robots = NO_ROBOTS
        self.options = scene_parameters.detector_options(self.settings)
        if why := unusable_options(self.options) or unrecordable(self.settings):
            raise ParameterError(why)

    def follow(self, configured: Callable[[], bool], on_change: Callable[[], None]) -> None:
        """From now on parameters may be set. configured: whether the life cycle is past `unconfigured`."""

        def check(wanted: dict[str, Any], meshes: Meshes) -> str | None:
            for name, topic, off in (
                ("stop_distance", "stop", lambda value: value < 0),
                ("approach_time", "speed_scale", lambda value: value == 0),
            ):
                if configured() and off(wanted[name]) != off(self.settings[name]):
                    return (
                        f"{name}: {wanted[name]} would switch the topic {topic} on or off, which it may not be while "
                        "the node is configured; run hpccd lifecycle deactivate, then cleanup"
                    )
            return self._check(wanted, meshes)

        def changed() -> None:
            self.options = scene_parameters.detector_options(self.settings, self.robots)
            on_change()

        parameters.watch(self._node, self.settings, self.meshes, configured=configured, check=check, on_change=changed)

    def with_robots(self, robots: Robots) -> SceneBuilder:
        """From now on these are known; the scene with them. Raises ParameterError, and then those before stay: a pair
        names a link that there is not, nothing could ever be near for stop_distance."""
        robots = dict(robots)
        options = scene_parameters.detector_options(self.settings, robots)
        builder = scene_parameters.scene_builder(self.settings, self.meshes, robots)
        if len(robots) == len(self.settings["robots"]):
            scene_parameters.check_stop(self.settings, builder)
        self.options, self.robots = options, robots
        return builder

    def forget_robots(self) -> None:
        """None is known."""
        self.robots = NO_ROBOTS
        self.options = scene_parameters.detector_options(self.settings)

    def summary(self, contacts: str) -> str:
        """For the log, in one line. contacts: name of the topic."""
        options = self.options
        robots, planes = (listed(self.settings[kind]) for kind in ("robots", "planes"))
        where = f"on this host only ({environment.DISCOVERY}=SUBNET opens it)"
        meshes = listed(self.meshes) or ("none" if robots else "none (service only)")
        return (
            f"meshes {meshes}; {f'robots {robots}; ' if robots else ''}{f'planes {planes}; ' if planes else ''}"
            f"tests {listed(options.features)}; accuracy {options.accuracy}, backend {options.backend}, "
            f"contacts on {contacts}; "
            f"discovery {where if environment.this_host_only() else 'beyond this host'}"
        )

    def _unusable_topics(self, settings: dict[str, Any], meshes: Meshes) -> str | None:
        robots = settings[ROBOT]
        topics = topic_names.subscribed(meshes, robot_parameters.subscribed(robots))
        return (
            robot_parameters.unusable_home(robots)
            or topic_names.unusable_name(self._node, topics)
            or contradiction(self._node, settings, meshes)
        )

    def _check(self, wanted: dict[str, Any], meshes: Meshes) -> str | None:
        try:
            scene_parameters.check(wanted, meshes, self.robots)
            options = scene_parameters.detector_options(wanted, self.robots)
        except ParameterError as error:
            return str(error)
        if why := self._unusable_topics(wanted, meshes) or unrecordable(wanted):
            return why
        return None if options == self.options else unusable_options(options)


# Types of the node's own topics, and of those that every ROS node has.
_PUBLISHED = {
    **RESULTS,
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
